"""Linear regression on columns of one's own."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from plantune import _core
from plantune.errors import refusal
from plantune.estimate.fit import Fit, fit_from_core
from plantune.notes import DEFAULT_LIMITS
from plantune.record import columns


def least_squares(phi: ArrayLike, y: ArrayLike) -> Fit:
    """Solve min |y - phi theta|^2 on exactly the columns given.

    Parameters
    ----------
    phi : array (N, n)
        Regressor; a constant is a column of ones.
    y : array (N,)
        Right-hand side.

    Returns
    -------
    Fit
        Without a model; `P` is `s^2 (phi' phi)^-1`, `s^2 = RSS / (N - n)`; `expected_digits` says
        how many decimal digits rounding leaves to each parameter.

    Raises
    ------
    DataError
        Lengths differ (D09), or a number is not finite (D07).
    NotIdentifiable
        A column depends on the others (X02), or fewer rows than columns (X03).
    NumericsError
        Rounding leaves less than three digits of a coefficient (N04).

    Notes
    -----
    Column-scaled, column-pivoted QR, refined with residuals in twice the precision where the
    condition asks for it.  Source 000, (2.2-5).

    Examples
    --------
    >>> least_squares([[1, 0], [1, 1], [1, 2]], [1.0, 3.0, 5.0]).theta
    array([1., 2.])
    """
    table = np.asarray(phi)
    if table.ndim != 2:
        raise refusal("D10", f"`phi` has shape {table.shape}", remedy="pass phi as (N, n)")
    phi, y = np.ascontiguousarray(table, np.float64), columns(y, "y")
    if len(phi) != len(y):
        raise refusal(
            "D09",
            f"`phi` has {len(phi)} rows and `y` has {len(y)}",
            count=abs(len(phi) - len(y)),
            remedy="give phi one row per value of y",
        )
    fit = _core.least_squares(phi, np.ascontiguousarray(y[:, 0]))
    return fit_from_core(fit, "least squares", None, DEFAULT_LIMITS)
