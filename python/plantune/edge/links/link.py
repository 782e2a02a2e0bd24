"""What every link to a plant does: read a sample, write controller settings."""

from __future__ import annotations

from dataclasses import dataclass
from math import isclose
from typing import Protocol, runtime_checkable

from plantune.adapt import Sample
from plantune.errors import PlantuneError, refusal
from plantune.models import PID

READABLE = frozenset({"r", "u", "y", "aux", "Kp", "Ti", "Td"})
"""Names that a link may read."""

WRITABLE = frozenset({"r", "u", "Kp", "Ti", "Td"})
"""Names that a link may write."""


@dataclass(frozen=True, slots=True)
class Capabilities:
    """What a link can read and write.

    Parameters
    ----------
    read : set of str
        Among `r u y aux` and the controller settings `Kp Ti Td`.
    write : set of str
        Among `r u` and `Kp Ti Td`.

    Raises
    ------
    UsageError
        A name that is none of these (U01).

    Examples
    --------
    >>> sorted(Capabilities(read={"u", "y"}).read)
    ['u', 'y']
    """

    read: frozenset[str] = READABLE
    write: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        for name, allowed in (("read", READABLE), ("write", WRITABLE)):
            asked = frozenset(getattr(self, name))
            if not asked <= allowed:
                strange, fine = sorted(asked - allowed), " ".join(sorted(allowed))
                raise refusal(
                    "U01",
                    f"`{name}` holds {strange}, must be among {fine}",
                    remedy="mend the names",
                )
            object.__setattr__(self, name, asked)


@runtime_checkable
class Link(Protocol):
    """A plant and its controller, sample by sample.

    A link that talks to a real plant keeps the clock: `read` returns once the next sample is
    there.  Nothing else knows what time it is.

    Attributes
    ----------
    Ts : float
        Sample time, seconds.
    capabilities : Capabilities
        What it can read and write; a simulated plant and a record differ from a field bus here.
    controller : PID or None
        The settings at work, as far as they can be read.

    Examples
    --------
    >>> import plantune as pt
    >>> isinstance(pt.edge.RecordedPlant(pt.datasets.engine_loop(t_end=1.0)), Link)
    True
    """

    @property
    def Ts(self) -> float:
        """Sample time, seconds."""

    @property
    def capabilities(self) -> Capabilities:
        """What it can read and write."""

    @property
    def controller(self) -> PID | None:
        """The settings at work, as far as they can be read."""

    def read(self) -> Sample | None:
        """Return the next sample; None at the end."""

    def write(
        self, controller: PID | None = None, *, r: float | None = None, u: float | None = None
    ) -> None:
        """Write controller settings, a set point or an input; what is None is left alone.

        Raises
        ------
        RunError
            The link cannot write it (C09).
        """


def same_settings(a: PID, b: PID) -> bool:
    """Whether settings are the same, but for the rounding of a controller in single precision."""
    pairs = ((a.Kp, b.Kp), (a.Ki, b.Ki), (a.Td, b.Td))
    return all(isclose(x, y, rel_tol=1e-6) for x, y in pairs)


def asked_for(controller: PID | None, r: float | None, u: float | None) -> frozenset[str]:
    """Name what a call of `write` wants written."""
    settings = {"Kp", "Ti", "Td"} if controller is not None else set()
    signals = {name for name, x in (("r", r), ("u", u)) if x is not None}
    return frozenset(settings | signals)


def unwritable(names: frozenset[str], by: str) -> PlantuneError:
    """Return the refusal of a write that a link cannot do."""
    listed = " ".join(sorted(names))
    return refusal(
        "C09",
        f"{by} does not take {listed}",
        remedy="write what its capabilities name, or run in shadow",
    )
