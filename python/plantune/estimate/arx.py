"""ARX by least squares."""

from __future__ import annotations

from collections.abc import Sequence

from plantune import _core
from plantune.errors import refusal
from plantune.estimate.fit import Fit, fit_from_core
from plantune.notes import DEFAULT_LIMITS, Limits
from plantune.record import Record


def arx(
    rec: Record,
    na: int,
    nb: int | Sequence[int],
    nk: int | Sequence[int] = 1,
    *,
    offset: bool = True,
    limits: Limits | None = None,
) -> Fit:
    """Fit A(q) y(t) = B(q) u(t - nk) + e(t) by least squares.

    Parameters
    ----------
    rec : Record
        One output, nu inputs; segments and `valid` are honoured.
    na : int
        Number of a coefficients, >= 0.
    nb, nk : int, or one per input
        Number of b coefficients, >= 1; delay in samples (0 = direct term).
    offset : bool
        Whether a constant is estimated as well; it comes back as `O` in `y = G u + O`.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    Fit
        `theta` (n,) ordered a then b; `P` covariance of theta and the offset; `loss` in units
        of y squared.

    Raises
    ------
    NotIdentifiable
        The input stands still (X01) or supports fewer parameters (X02); fewer usable rows than
        parameters (X03); a delay beyond a third of the record (X05); a regressor without full
        rank (X08); inputs that copy each other (X11).
    UsageError
        Orders that do not fit the record (U01).

    Notes
    -----
    QR of the regressor, which is streamed and never held; not the normal equations.
    Source 000, (2.2-3) to (2.2-5).  For output noise prefer `process`, which is not biased.

    Examples
    --------
    >>> import plantune as pt
    >>> rec = pt.prep.detrend(pt.datasets.hair_dryer().take(slice(0, 300)))
    >>> fit = pt.estimate.arx(rec, 2, 2, 3, offset=False)
    >>> fit.theta.round(6), fit.N
    (array([-1.273739,  0.393546,  0.066618,  0.044482]), 296)
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    orders = _whole("na", na), _per_input("nb", nb, rec.nu), _per_input("nk", nk, rec.nu)
    return fit_from_core(_core.arx(rec, *orders, offset, limits), "ARX", rec, limits)


def _whole(name: str, value: object) -> int:
    if not isinstance(value, bool) and hasattr(value, "__index__") and value.__index__() >= 0:
        return value.__index__()  # type: ignore[no-any-return]
    raise refusal("U01", f"`{name}` is {value!r}, must be whole and >= 0", remedy=f"{name}=2")


def _per_input(name: str, value: int | Sequence[int], nu: int) -> list[int]:
    values = list(value) if isinstance(value, Sequence) else [value] * nu
    return [_whole(name, v) for v in values]
