"""Stability of a loop, and the room that each setting has."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from plantune import _core
from plantune.models import PID
from plantune.models.base import LinearModel
from plantune.text import number


@dataclass(frozen=True, slots=True)
class Stability:
    """Whether a loop is stable, and between which values of each setting it stays so.

    Attributes
    ----------
    stable : bool
        Whether it is; so is the truth of the value itself.
    bounds : mapping of str to (float, float)
        Open intervals: `Kp` with `Ti` and `Td` held, `Ki` and `Ti` with `Kp` and `Kd` held, `Kd`
        with `Kp` and `Ki` held.  The interval that holds the setting; of an unstable loop the
        stable one that is nearest; NaN where there is none.
    delay : str
        How the dead time was treated.

    Examples
    --------
    >>> import plantune as pt
    >>> plant = pt.models.ProcessModel(K=2.0, T=5.0, L=1.0)
    >>> print(pt.tune.stability(plant, pt.models.PID(Kp=1.0, Ti=5.0)))
    stable, the dead time exact
      Kp between 0 and 3.927
      Ki between 0 and 1.345
      Ti between 0.7435 and ∞
      Kd between -1.904 and 2.5
    """

    stable: bool
    bounds: Mapping[str, tuple[float, float]]
    delay: str

    def __bool__(self) -> bool:
        return self.stable

    def __str__(self) -> str:
        by = {"exact": "exact", "pade": "by Padé", "taylor": "by Taylor"}[self.delay]
        lines = [f"{'stable' if self.stable else 'unstable'}, the dead time {by}"]
        lines += [
            f"  {name} between {number(low)} and {number(high)}"
            for name, (low, high) in self.bounds.items()
        ]
        return "\n".join(lines)


def stability(model: LinearModel, pid: PID, *, delay: str = "exact") -> Stability:
    """Return whether the loop is stable, and the stable interval of each setting.

    Parameters
    ----------
    model : ProcessModel, TransferFunction or PolyModel
        The plant; its first input is the controller's output.
    pid : PID
        A sampled one meets the exact pulse transfer function.
    delay : "exact", "pade" or "taylor"
        The dead time as it is, or by the forms of source 001, (3.4-3) and (3.4-5).

    Returns
    -------
    Stability

    Raises
    ------
    UsageError
        An approximation is asked for a sampled loop, or another word (U01).
    NotIdentifiable
        The model is none (M12).

    Notes
    -----
    A rational loop is judged by Routh's array, a sampled one by its poles, a dead time by the
    argument principle.  Source 001, (3.4-19) to (3.4-30), for either sign of K.  The approximations
    err on both sides: Taylor bounds `Kp` by `T/(K L)`, where the exact bound is higher.

    Examples
    --------
    >>> from plantune.models import PID, ProcessModel
    >>> plant, pi = ProcessModel(K=2.0, T=5.0, L=1.0), PID(Kp=1.0, Ti=5.0)
    >>> for delay in ("taylor", "pade", "exact"):
    ...     low, high = stability(plant, pi, delay=delay).bounds["Kp"]
    ...     print(f"{delay}: {low:.3f} to {high:.3f}")
    taylor: 0.000 to 2.500
    pade: 0.000 to 5.000
    exact: 0.000 to 3.927
    """
    stable, bounds = _core.stability(model, pid, delay)
    return Stability(stable, dict(zip(("Kp", "Ki", "Ti", "Kd"), bounds, strict=True)), delay)
