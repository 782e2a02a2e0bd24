"""ARX with regressors of one's own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from plantune import _core
from plantune.errors import refusal
from plantune.estimate.fit import Fit, fit_from_core
from plantune.estimate.orders import PerInput, orders
from plantune.models.poly import PolyModel
from plantune.models.terms import (
    Regressor,
    TermModel,
    given_columns,
    numbered,
    regressors_of,
)
from plantune.notes import Limits
from plantune.record import Record


def term_arx(
    rec: Record,
    na: int,
    nb: PerInput,
    nk: PerInput,
    regressors: Sequence[Regressor],
    offset: bool,
    limits: Limits,
) -> Fit:
    """Fit ARX with these regressors, as `arx` says, which calls it; `nb` may be 0."""
    if rec.ny != 1:
        raise refusal(
            "U01",
            f"`rec` has {rec.ny} outputs, regressors of one's own are for one",
            where=("rec", None, None),
            remedy="fit one output at a time",
        )
    regressors = regressors_of(regressors)
    wanted = orders(rec.nu, na=na, nb=nb, nk=nk)
    given = given_columns(regressors, rec)
    d = _core.term_arx(rec, wanted, numbered(regressors), given, offset, limits)
    fit = fit_from_core(d, "ARX", rec, limits)
    model: Any = _model(fit, rec, regressors)
    return replace(fit, model=model)


def _model(fit: Fit, rec: Record, regressors: tuple[Regressor, ...]) -> TermModel:
    """Return the model; that of the core has one input more for each regressor."""
    wide = fit.model
    assert isinstance(wide, PolyModel)
    B, nk = wide.core.B[: rec.nu], wide.core.nk[: rec.nu]
    return TermModel(
        A=wide.A,
        B=B,
        nk=nk,
        regressors=regressors,
        g=fit.theta[len(wide.A) - 1 + sum(map(len, B)) :],
        d=float(fit.offset[0]),
        Ts=rec.Ts,
        u_names=rec.u_names,
        y_name=rec.y_names[0],
    )
