"""Models fitted to a frequency response."""

from __future__ import annotations

from dataclasses import replace

from plantune import _core
from plantune.errors import refusal
from plantune.estimate.fit import Fit, fit_from_core
from plantune.models import FrequencyResponse
from plantune.notes import DEFAULT_LIMITS


def frequency(
    fr: FrequencyResponse,
    code: str | None = None,
    *,
    nb: int | None = None,
    nf: int | None = None,
    nk: int = 1,
    delay: bool = True,
    input: int = 0,
    output: int = 0,
) -> Fit:
    """Fit a process model, or a ratio of polynomials, to G(w): min sum |G - G(theta)|^2/sd^2.

    Parameters
    ----------
    fr : FrequencyResponse
        From `analyze.spa`, `analyze.etfe` or measured elsewhere.  Points that are not coherent
        are left out; without discs all points weigh the same.
    code : str, optional
        Process code such as "P1D", as of `estimate.process`; any real dead time.
    nb, nf : int, optional
        Without a code: coefficients of the numerator, at least 1, and poles.
    nk : int
        Delay in samples where `fr` is sampled.
    delay : bool
        Whether a dead time is estimated where `fr` is continuous.
    input, output : int
        Which of several.

    Returns
    -------
    Fit
        A ProcessModel; with polynomials a PolyModel `B(q)/F(q) q^-nk` of sampled data, a
        TransferFunction `(b0 + b1 s + ...)/(1 + a1 s + ...) e^(-L s)` of continuous data.  `loss`
        is the mean squared residual in units of its variance: about 1 where the model holds, more
        where it departs; in squared units of G without discs.  `N` counts points.  There is no
        offset.

    Raises
    ------
    NotIdentifiable
        Fewer points than parameters need (X03); parameters that the points do not tell apart
        (X10).
    UsageError
        Neither code nor polynomials, or a code that does not exist (U01).

    Notes
    -----
    Levenberg-Marquardt from several starts: a grid of times and delays, or the rounds of Sanathanan
    and Koerner.  Of sampled data the model is sampled exactly behind a zero-order hold.  The
    covariance is scaled by what the residuals show, and by `fr.share`.

    Examples
    --------
    >>> import numpy as np, plantune as pt
    >>> w = np.geomspace(0.01, 10, 40)
    >>> truth = pt.models.ProcessModel(K=2.0, T=3.0, L=0.7)
    >>> fr = pt.models.FrequencyResponse(w=w, G=truth.freqresp(w), sd=0.01)
    >>> print(frequency(fr, "P1D").model)
    G(s) = 2 e^(-0.7 s) / (3 s + 1)
    """
    structure = _structure(code, nb, nf, nk, delay)
    fields = _core.frequency_fit(fr.take(fr.coherent), output, input, structure)
    method = f"{code} over frequency" if code else f"B/F ({nb}, {nf}) over frequency"
    fit = fit_from_core(fields, method, None, DEFAULT_LIMITS)
    return replace(fit, source=fr.source, Ts=fr.Ts)


def _structure(
    code: str | None, nb: int | None, nf: int | None, nk: int, delay: bool
) -> str | tuple[int, int, int, bool]:
    if code is not None and nb is None and nf is None:
        return code
    if code is None and nb is not None and nf is not None and min(nb, nf, nk) >= 0:
        return nb, nf, nk, delay
    raise refusal(
        "U01",
        "give either a process code, or both `nb` and `nf`, none below zero",
        remedy="frequency(fr, 'P1D') or frequency(fr, nb=2, nf=2, nk=1)",
    )
