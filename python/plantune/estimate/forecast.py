"""What comes after the last row of a record."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from plantune.record import Floats


@dataclass(frozen=True, slots=True, eq=False)
class Forecast:
    """The output to come, one value for each row of the input to come.

    Attributes
    ----------
    t : array (K,)
        Time, seconds.
    y, sd : array (K,)
        Expected output and its standard deviation, in the record's units.
    source : str
        Fingerprint of the record before it.

    Examples
    --------
    >>> import plantune as pt
    >>> past, ahead = pt.datasets.hair_dryer().split(0.5)
    >>> fit = pt.estimate.arx(past, 2, 2, 3)
    >>> forecast = fit.forecast(past, ahead.u[:4])
    >>> print(forecast)
    t 40.00 s  5.4873 ± 0.042
    t 40.08 s  5.1527 ± 0.068
    t 40.16 s  4.8077 ± 0.085
    t 40.24 s  4.4999 ± 0.096
    """

    t: Floats
    y: Floats
    sd: Floats
    source: str

    def band(self, sds: float = 1.96) -> Floats:
        """Return lower and upper bound (K, 2), so many standard deviations away.

        Examples
        --------
        >>> import numpy as np
        >>> one = Forecast(t=np.array([1.0]), y=np.array([5.0]), sd=np.array([0.5]), source="")
        >>> one.band(2.0).tolist()
        [[4.0, 6.0]]
        """
        return np.column_stack([self.y - sds * self.sd, self.y + sds * self.sd])

    def __str__(self) -> str:
        rows = zip(self.t, self.y, self.sd, strict=True)
        return "\n".join(f"t {t:.2f} s  {y:.5g} ± {sd:.2g}" for t, y, sd in rows)
