"""Which signal is read from the plant, played from a record or simulated, and what is written.

Source 001, 3.7.2: read and write flags; with all of them off the system is a pure simulation.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from plantune.errors import refusal

Origin = Literal["plant", "record", "simulated"]

SIGNALS = ("r", "u", "y", "aux")
PARAMETERS = ("Kp", "Ti", "Td")
_ORIGINS = ("plant", "record", "simulated")
_WRITABLE = frozenset({"r", "u", *PARAMETERS})


@dataclass(frozen=True, slots=True)
class Flags:
    """Where each signal and controller setting comes from, and what is written to the plant.

    Parameters
    ----------
    r, u, y, aux : "plant", "record" or "simulated"
        Set point, input, output, further signals.
    Kp, Ti, Td : "plant", "record" or "simulated"
        Controller settings; a simulated one is what the auto-tuner decided last.
    write : iterable of str
        What is written to the plant, among `r u Kp Ti Td`.

    Raises
    ------
    UsageError
        An origin or a name that is none of these, or a simulated set point (U01).

    Examples
    --------
    >>> Flags.live().mode, sorted(Flags.live().write)
    ('live', ['Kp', 'Td', 'Ti'])
    >>> Flags(u="simulated").mode, Flags("record", "record", "record").mode
    ('partial simulation', 'full simulation')
    """

    r: Origin = "plant"
    u: Origin = "plant"
    y: Origin = "plant"
    aux: Origin = "plant"
    Kp: Origin = "plant"
    Ti: Origin = "plant"
    Td: Origin = "plant"
    write: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        for name in (*SIGNALS, *PARAMETERS):
            if (origin := getattr(self, name)) not in _ORIGINS:
                raise refusal(
                    "U01",
                    f"`{name}` is {origin!r}, must be 'plant', 'record' or 'simulated'",
                    remedy=f'{name}="plant"',
                )
        object.__setattr__(self, "write", frozenset(self.write))
        if strange := sorted(self.write - _WRITABLE):
            fine = " ".join(sorted(_WRITABLE))
            raise refusal("U01", f"`write` holds {strange}, must be among {fine}", remedy="mend it")
        if self.r == "simulated" and "simulated" in (self.u, self.y):
            raise refusal(
                "U01",
                "`r` is 'simulated', must be read: nothing else could excite the simulation",
                remedy='r="record"',
            )

    @staticmethod
    def full_simulation() -> Flags:
        """Return flags that read the set point from a record, simulate the rest and write nothing.

        Examples
        --------
        >>> Flags.full_simulation().y
        'simulated'
        """
        return Flags("record", *["simulated"] * 6)  # type: ignore[arg-type]

    @staticmethod
    def partial_simulation(*simulated: str, rest: Origin = "record") -> Flags:
        """Return flags that simulate what is named, read the rest from one place and write nothing.

        Examples
        --------
        >>> Flags.partial_simulation("u").read("record") >= {"r", "y"}
        True
        """
        names = (*SIGNALS, *PARAMETERS)
        if strange := sorted(set(simulated) - set(names)):
            fine = " ".join(names)
            raise refusal("U01", f"{strange} is named, must be among {fine}", remedy="mend it")
        origins = {name: "simulated" if name in simulated else rest for name in names}
        return Flags(**origins)  # type: ignore[arg-type]

    @staticmethod
    def shadow() -> Flags:
        """Return flags that read all from the plant and write nothing.

        Examples
        --------
        >>> Flags.shadow().mode, Flags.shadow() == Flags()
        ('shadow', True)
        """
        return Flags()

    @staticmethod
    def live(write: Iterable[str] = PARAMETERS) -> Flags:
        """Return flags that read all from the plant, and write the settings or what is named.

        Examples
        --------
        >>> sorted(Flags.live(write=["Kp"]).write)
        ['Kp']
        """
        return Flags(write=frozenset(write))

    @property
    def mode(self) -> str:
        """`full simulation`, `partial simulation`, `shadow` or `live`.

        A full simulation has no plant: signals are played or simulated, nothing is written.
        """
        # Settings and further signals do not make a simulation: they may be unknown.
        signals = {self.r, self.u, self.y}
        if signals == {"plant"}:
            return "live" if self.write else "shadow"
        return "partial simulation" if "plant" in signals or self.write else "full simulation"

    def read(self, origin: Origin | str) -> frozenset[str]:
        """Return the names that come from there.

        Examples
        --------
        >>> sorted(Flags(y="record", u="record").read("record"))
        ['u', 'y']
        """
        names = (*SIGNALS, *PARAMETERS)
        return frozenset(name for name in names if getattr(self, name) == origin)
