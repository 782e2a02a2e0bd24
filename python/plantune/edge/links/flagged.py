"""A plant and a record behind flags: each signal comes from where its flag says."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from plantune.adapt import Sample
from plantune.edge.flags import PARAMETERS, Flags
from plantune.edge.links.link import Capabilities, Link, asked_for, same_settings, unwritable
from plantune.errors import refusal
from plantune.models import PID


class FlaggedLink:
    """One link out of a plant and a record.

    A signal flagged `"simulated"` is not read, None in the samples: the auto-tuner fills it from
    its model or its controller.

    Parameters
    ----------
    flags : Flags
        Where each signal and setting comes from, and what is written.
    plant : Link, optional
        Needed for what is flagged `"plant"`, and for what is written.
    record : Link, optional
        Needed for what is flagged `"record"`; most often a `RecordedPlant`.

    Attributes
    ----------
    withheld : list of (float, PID)
        Time and settings of each write that the flags kept from the plant.
    Ts, capabilities, controller : float, Capabilities, PID or None
        As every `Link` has them.

    Raises
    ------
    UsageError
        A flag asks for a link that is missing, or for what its link cannot do (U01).

    Examples
    --------
    >>> import plantune as pt
    >>> pid = pt.models.PID(Kp=0.5, Ti=1.0)
    >>> plant = pt.edge.SimulatedPlant([1.0, 3.0], pid, K=2.0, T=1.0, Ts=0.1)
    >>> link = FlaggedLink(pt.edge.Flags.shadow(), plant)
    >>> link.read()
    Sample(t=0.0, r=1.0, u=0.5, y=1.0, aux={}, controller=None)
    >>> link.write(pt.models.PID(Kp=1.0, Ti=1.0))
    >>> plant.controller.Kp, len(link.withheld)
    (0.5, 1)
    """

    def __init__(self, flags: Flags, plant: Link | None = None, record: Link | None = None) -> None:
        self.flags = flags
        self.withheld: list[tuple[float, PID]] = []
        self._links = {"plant": plant, "record": record}
        self._read: dict[str, Link] = {}
        for source, link in self._links.items():
            if needed := flags.read(source) & {"r", "u", "y"}:
                self._read[source] = _able(link, source, "read", needed)
            elif link is not None and flags.aux == source:
                self._read[source] = link
        if not self._read:
            raise refusal(
                "U01",
                "`flags` read nothing, must read a set point at least",
                remedy="Flags.full_simulation() reads it from a record",
            )
        self._plant = _able(plant, "plant", "write", flags.write) if flags.write else None
        self._own: PID | None = None
        self._now = 0.0

    @property
    def Ts(self) -> float:
        """Sample time, seconds."""
        return next(iter(self._read.values())).Ts

    @property
    def capabilities(self) -> Capabilities:
        """What the flags let through."""
        return Capabilities(self.flags.read("plant") | self.flags.read("record"), self.flags.write)

    @property
    def controller(self) -> PID | None:
        """Each setting from where its flag says; a simulated one is what was written last."""
        origins = {name: self._of(getattr(self.flags, name)) for name in PARAMETERS}
        known = {name: pid for name, pid in origins.items() if pid is not None}
        if "Kp" not in known or "Ti" not in known:
            return None
        return replace(known["Kp"], **{name: getattr(pid, name) for name, pid in known.items()})

    def read(self) -> Sample | None:
        """Return the next sample, with None for what is simulated; None where a link ends."""
        samples: dict[str, Sample] = {}
        for source, link in self._read.items():
            if (sample := link.read()) is None:
                return None
            samples[source] = sample
        self._now = next(iter(samples.values())).t

        def of(name: str) -> Any:
            return getattr(samples.get(getattr(self.flags, name)), name, None)

        return Sample(self._now, of("r"), of("u"), of("y"), of("aux") or {})

    def write(
        self, controller: PID | None = None, *, r: float | None = None, u: float | None = None
    ) -> None:
        """Write what the flags let through; settings that they keep back go to `withheld`."""
        if unknown := asked_for(None, r, u) - self.flags.write:
            raise unwritable(unknown, "the flags")
        if controller is not None:
            self._own = controller
            through = self._let_through(controller)
            if through is None or not same_settings(through, controller):
                self.withheld.append((self._now, controller))
            controller = through
        if self._plant is not None:
            self._plant.write(controller, r=r, u=u)

    def _let_through(self, controller: PID) -> PID | None:
        """Put the settings that may be written among those at work."""
        names = [name for name in PARAMETERS if name in self.flags.write]
        present = self._plant.controller if self._plant is not None else None
        if len(names) == len(PARAMETERS):
            return controller
        if not names or present is None:
            return None
        return replace(present, **{name: getattr(controller, name) for name in names})

    def _of(self, origin: str) -> PID | None:
        link = self._links.get(origin)
        return self._own if link is None else link.controller


def _able(link: Link | None, source: str, verb: str, names: frozenset[str]) -> Link:
    """Return the link if it can do what the flags ask of it."""
    if link is None:
        listed = " ".join(sorted(names))
        text = f"`{source}` is None, but the flags {verb} {listed} there"
        raise refusal("U01", text, remedy=f"give `{source}`")
    able = link.capabilities.read if verb == "read" else link.capabilities.write
    if missing := names - able:
        listed = " ".join(sorted(missing))
        text = f"`{source}` cannot {verb} {listed}, which the flags ask for"
        raise refusal("U01", text, remedy="flag it otherwise")
    return link
