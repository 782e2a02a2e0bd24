"""Impulse response without a model, with its bands."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plantune import _core
from plantune.errors import refusal
from plantune.notes import DEFAULT_LIMITS, Limits, Note, notes_from_core
from plantune.record import Floats, Record


@dataclass(frozen=True, slots=True, eq=False)
class ImpulseResponse:
    """How y answers an impulse and a step of each input, sample by sample.

    Of one input the arrays are as given here; of several they have an axis more, the last but of
    `P` and `weights`, where it is the first: `g (n, nu)`, `P (nu, n, n)`.

    Attributes
    ----------
    lags, t : array (n,)
        Lag of each tap in samples, and in seconds.
    g, sd : array (n,)
        Taps, y/u per sample, and their standard deviations.
    P : array (n, n)
        Covariance of the taps.
    step, step_sd : array (n,)
        Running sum of the taps: the response to a unit step; its standard deviations.
    gain, gain_sd : float
        Sum of all taps.
    nk : int
        Delay in samples: lag of the first tap that is alive.
    delays, weights : array (k,)
        Delays that were weighed, and the weight of each; they sum to 1.  Empty of least squares.
    kernel : str or None
        Shape of the prior.
    c, lam, rho : float
        Its size (squared units of g), decay and, of "dc", correlation; NaN where there is none.
    noise_sd : float
        Standard deviation of the white errors behind y, in its unit.
    D : array (p + 1,)
        `D(q) v = e`, the colour of the errors: both signals were filtered by it.  `[1]` is white.
    evidence : float
        `-2 ln p(y)` up to a constant; NaN of least squares.
    N : int
        Rows used.
    inputs, output : tuple of str, str
        Columns.
    notes : tuple of Note
        Doubts.
    source : str
        Fingerprint of the record.

    Examples
    --------
    >>> import plantune as pt
    >>> h = pt.analyze.impulse(pt.datasets.hair_dryer(), n=40)
    >>> h.nk, h.g.shape, round(h.gain, 2)
    (2, (40,), 0.94)
    """

    lags: NDArray[np.int64]
    t: Floats
    g: Floats
    sd: Floats
    P: Floats
    step: Floats
    step_sd: Floats
    gain: float | Floats
    gain_sd: float | Floats
    nk: int | NDArray[np.int64]
    delays: NDArray[np.int64]
    weights: Floats
    kernel: str | None
    c: float | Floats
    lam: float | Floats
    rho: float | Floats
    noise_sd: float
    D: Floats
    evidence: float
    N: int
    inputs: tuple[str, ...]
    output: str
    notes: tuple[Note, ...]
    source: str

    def __str__(self) -> str:
        way = f"{self.kernel.upper()} kernel" if self.kernel else "least squares"
        head = f"impulse response of {self.output}, {len(self.lags)} taps, {way}, {self.N} rows"
        each = zip(
            self.inputs,
            np.atleast_1d(self.gain),
            np.atleast_1d(self.gain_sd),
            np.atleast_1d(self.nk),
            strict=True,
        )
        lines = [f"  {u}: gain {gain:.4g} ± {sd:.2g}, nk = {nk}" for u, gain, sd, nk in each]
        return "\n".join([head, *lines, *(f"  {note}" for note in self.notes)])


def impulse(
    rec: Record,
    n: int = 60,
    kernel: str | None = "tc",
    *,
    nk: int | None = None,
    direct: bool = False,
    whiten: bool = True,
    output: str | None = None,
    limits: Limits | None = None,
) -> ImpulseResponse:
    """Estimate `y(t) = O + sum_k g_k u(t - k) + v(t)` without a model.

    Parameters
    ----------
    rec : Record
        Any number of inputs; segments are honoured.
    n : int
        Number of taps, >= 1.  Enough for the response to die away, and fewer than the rows.
    kernel : "tc", "dc", "ss" or None
        What is believed of the taps: they are smooth and die away.  "tc" is the one to use; "dc"
        has a correlation of its own, "ss" is smoother still, and good where taps, not bands,
        matter.  None believes nothing: least squares, several times as noisy.
    nk : int, optional
        The delay, where it is known: taps before it are zero.  Otherwise it is weighed.
    direct : bool
        Whether y may jump with u: then the first tap has lag 0.  Not in closed loop, where u
        jumps with y.
    whiten : bool
        Whether coloured errors are taken into account.  Bands are too narrow without.
    output : str, optional
        Which, of several outputs.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    ImpulseResponse
        With note X07 where the response has not died away within `n` taps.

    Raises
    ------
    NotIdentifiable
        Not more rows than taps (X03): the message says how many taps there is room for.  An input
        stands still (X01); without a kernel, the inputs do not tell the taps apart (X02).

    Notes
    -----
    The size and decay of the prior have the most evidence, each input its own.  The count of dead
    taps before the response begins is weighed by evidence as well, and taps and bands are averages
    over it.  Bands are those of TC whatever the kernel: those of SS are too narrow (63 to 86 %
    hold), those of DC a little.  METHODS 2.3; Chen, Ohlsson and Ljung 2012.

    Examples
    --------
    >>> import plantune as pt
    >>> print(pt.analyze.impulse(pt.datasets.hair_dryer(), n=40))
    impulse response of temp, 40 taps, TC kernel, 959 rows
      power: gain 0.9355 ± 0.013, nk = 2
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    _check(n, nk, kernel)
    which = output_number(rec, output)
    d = _core.impulse(rec, which, (n, kernel, direct, nk, whiten), limits)
    return impulse_from_core(d, rec, which, kernel, limits)


def impulse_from_core(
    d: Mapping[str, Any], rec: Record, which: int, kernel: str | None, limits: Limits
) -> ImpulseResponse:
    """Return the fields that the core sends, input by input, as a value."""
    single = rec.nu == 1

    def curves(name: str) -> Floats:
        return d[name][0] if single else np.stack(d[name], axis=1)

    def numbers(values: Iterable[float | None]) -> Any:
        x = np.array([np.nan if v is None else v for v in values])
        return x[0].item() if single else x

    n = len(d["g"][0])
    P = np.reshape(d["P"], (rec.nu, n, n))
    weights = _weights(d["weights"])
    lags = np.arange(d["first"], d["first"] + n)
    return ImpulseResponse(
        lags=lags,
        t=lags * rec.Ts,
        g=curves("g"),
        sd=curves("sd"),
        P=P[0] if single else P,
        step=curves("step"),
        step_sd=curves("step_sd"),
        gain=numbers(s[-1] for s in d["step"]),
        gain_sd=numbers(s[-1] for s in d["step_sd"]),
        nk=d["nk"][0] if single else np.array(d["nk"]),
        delays=d["first"] + np.arange(weights.shape[1]),
        weights=weights[0] if single else weights,
        kernel=kernel,
        c=numbers(d["c"]),
        lam=numbers(d["lam"]),
        rho=numbers(d["rho"]),
        noise_sd=d["noise_sd"],
        D=d["D"],
        evidence=np.nan if d["evidence"] is None else d["evidence"],
        N=d["N"],
        inputs=tuple(rec.u_names),
        output=rec.y_names[which],
        notes=(*notes_from_core(d["notes"]), *limits.changes()),
        source=rec.source,
    )


def _weights(rows: Sequence[Floats]) -> Floats:
    """Weights of all inputs, over the delays that any of them has."""
    longest = max(len(row) for row in rows)
    return np.array([np.pad(row, (0, longest - len(row))) for row in rows])


def _check(n: object, nk: object, kernel: object) -> None:
    for name, value, least in (("n", n, 1), ("nk", nk, 0)):
        if name == "nk" and value is None:
            continue
        if not (isinstance(value, int) and least <= value < 2**31):
            raise refusal(
                "U01",
                f"`{name}` is {value!r}, must be a whole number, at least {least}",
                where=(name, None, None),
                remedy=f"{name}=60" if name == "n" else "nk=1",
            )
    if not (kernel is None or isinstance(kernel, str)):
        raise refusal(
            "U01",
            f"`kernel` is {kernel!r}, must be 'tc', 'dc', 'ss' or None",
            where=("kernel", None, None),
            remedy="kernel='tc'",
        )


def output_number(rec: Record, output: str | None) -> int:
    """Return the number of the output; of several one has to be named."""
    if output is None and rec.ny == 1:
        return 0
    if output not in rec.y_names:
        names = ", ".join(map(repr, rec.y_names))
        came = "missing" if output is None else repr(output)
        raise refusal(
            "U01",
            f"`output` is {came}, must be one of {names}",
            where=("output", None, None),
            remedy=f"output={rec.y_names[0]!r}",
        )
    return rec.y_names.index(output)
