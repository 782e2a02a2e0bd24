"""Step response with the model's uncertainty."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go
from numpy.typing import ArrayLike

from plantune.estimate import Fit
from plantune.models import PolyModel, ProcessModel, TransferFunction
from plantune.plot.style import (
    BAND,
    SECOND_BAND,
    SEQUENCE,
    Names,
    axis,
    band,
    figure,
    inert,
    line,
    record_name,
)
from plantune.record import Floats, Record
from plantune.tune import step_band

POINTS = 401


def step(
    *fits: Fit, of: Record | None = None, input: int = 0, t: ArrayLike | None = None
) -> go.Figure:
    """Draw the response to a unit step of the input, with its 95 % band.

    Parameters
    ----------
    *fits : Fit
        The first is blue, the second orange.
    of : Record, optional
        Gives names and units.
    input : int
        Which input.
    t : array, optional
        Times in seconds; by default from 0 to `L + 6 T`, or over 100 samples where no process
        model is among the fits.

    Returns
    -------
    plotly.graph_objects.Figure

    Examples
    --------
    >>> import plantune as pt
    >>> fit = pt.estimate.process(pt.datasets.engine_loop(noise_var=1.5), "P1D")
    >>> [trace.name for trace in step(fit).data if trace.name]
    ['95 % of P1D', 'P1D']
    """
    names = Names(of, input)
    grid = _grid(fits) if t is None else np.asarray(t, float)
    methods = " and ".join(inert(fit.method) for fit in fits)
    fig = figure(
        f"Step response of {methods}, 95 % bands",
        f"{record_name(fits[0].source)}: {inert(names.y)} after {inert(names.u)} rises by 1, "
        "offset left out",
        [320],
    )
    for k, fit in enumerate(fits):
        low, high = step_band(fit, grid, input)
        label = f"95 % of {inert(fit.method)}"
        band(fig, grid, low, high, label, (BAND, SECOND_BAND)[k % 2])
    for k, fit in enumerate(fits):
        held = isinstance(fit.model, PolyModel)
        curve = fit.model.step(grid, input)
        line(fig, grid, curve, inert(fit.method), SEQUENCE[k % len(SEQUENCE)], held=held)
    fig.update_xaxes(title_text=axis("time", names.time_unit))
    fig.update_yaxes(title_text=axis(f"{names.y} per {names.u}", names.gain_unit, 36))
    return fig


def _grid(fits: tuple[Fit, ...]) -> Floats:
    """Choose times at which the curve bends, and enough between them."""
    for fit in fits:
        if isinstance(fit.model, ProcessModel):
            T, L = sum(fit.model.times), fit.model.L
            return np.union1d(np.linspace(0.0, L + 6 * T, POINTS), [L])
        if isinstance(fit.model, TransferFunction):
            return np.linspace(0.0, fit.model.horizon(), POINTS)
    Ts = fits[0].Ts or 1.0
    return np.asarray(np.arange(101) * Ts, np.float64)
