"""Frequency responses as they were measured: points, each in a disc."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plantune import _core
from plantune.errors import refusal
from plantune.notes import Note
from plantune.record import Floats

Complexes = NDArray[np.complex128]

COHERENT = 0.5
"""Coherence below which a point says more of the disturbance than of the plant."""


class Band(NamedTuple):
    """A curve with the ends of its 95 % band."""

    value: Floats
    low: Floats
    high: Floats


@dataclass(frozen=True, slots=True, eq=False)
class FrequencyResponse:
    """`G(w)` at some frequencies, each in the disc where it lies with 95 %.

    `analyze.spa` and `analyze.etfe` make one from a record; a sine test or a network analyser
    gives the numbers for one of your own.

    Parameters
    ----------
    w : array (n,)
        Frequencies, rad/s, ascending.
    G : array (n,) or (n, ny, nu), complex
        Response of output i from input j: `G[k, i, j]`.
    Ts : float, optional
        Sample time, seconds: `G` is then `G(e^(j w Ts))` of the plant behind a zero-order hold,
        which is what records show; without it `G(j w)`.
    sd : number, or array as G, optional
        Standard deviation of the complex error, `sqrt(E |error|^2)`.
    radius : number, or array as G, optional
        Radius of the 95 % disc, `sd sqrt(ln 20)` for an error whose parts are equal and normal.
        Give one of the two; infinite where nothing is known.
    coherence : array (n,) or (n, ny), optional
        Share of each output's power that the inputs explain.
    share : float
        Part of a point's information that its neighbours do not hold, in (0, 1]: points of
        averaged spectra overlap, and what is fitted to them must not count it twice.
    u_names, y_names : sequence of str, optional
        Names, by default `u` and `y`, or `u1 u2 …`.
    method : str
        How it came about.
    notes : sequence of Note
        Doubts.
    source : str
        Fingerprint of the record.

    Raises
    ------
    UsageError
        Frequencies that do not ascend or lie beyond `pi/Ts`, a negative radius, shapes that do
        not agree (U01).
    DataError
        Missing (D07) or infinite (D08) points.

    Examples
    --------
    >>> w = [0.1, 1.0, 10.0]
    >>> fr = FrequencyResponse(w=w, G=[2 / (1j * w + 1) for w in w], sd=0.01)
    >>> fr.n, fr.ny, fr.nu, fr.radius[:, 0, 0].round(4)
    (3, 1, 1, array([0.0173, 0.0173, 0.0173]))
    >>> print(fr)
    Frequency response: 3 frequencies from 0.1 to 10 rad/s, continuous
    """

    kind: ClassVar[str] = "frequency response"

    w: Floats
    G: Complexes
    Ts: float | None = None
    sd: Floats | None = None
    radius: Floats | None = None
    coherence: Floats | None = None
    share: float = 1.0
    u_names: tuple[str, ...] = ()
    y_names: tuple[str, ...] = ()
    method: str = ""
    notes: tuple[Note, ...] = ()
    source: str = ""

    def __post_init__(self) -> None:
        w = np.atleast_1d(np.array(self.w, np.float64))
        G = _points(self.G, len(w))
        fields: dict[str, Any] = {
            "w": w,
            "G": G,
            "Ts": None if self.Ts is None else float(self.Ts),
            **_discs(self.sd, self.radius, G.shape),
            "share": _share(self.share),
            "coherence": _coherence(self.coherence, G.shape),
            "u_names": _names(self.u_names, "u", G.shape[2]),
            "y_names": _names(self.y_names, "y", G.shape[1]),
            "notes": tuple(self.notes),
        }
        for name, value in fields.items():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False
            object.__setattr__(self, name, value)
        _core.check_frequency_response(self)

    @property
    def n(self) -> int:
        """Number of frequencies."""
        return len(self.w)

    @property
    def ny(self) -> int:
        """Number of outputs."""
        return int(self.G.shape[1])

    @property
    def nu(self) -> int:
        """Number of inputs."""
        return int(self.G.shape[2])

    @property
    def coherent(self) -> NDArray[np.bool_]:
        """Where every output has a coherence of at least one half (n,); figures blank the rest.

        Examples
        --------
        >>> FrequencyResponse(w=[1, 2], G=[1, 1], coherence=[0.9, 0.2]).coherent
        array([ True, False])
        """
        if self.coherence is None:
            return np.ones(self.n, bool)
        return np.asarray((self.coherence >= COHERENT).all(axis=1))

    def take(self, rows: ArrayLike | slice) -> FrequencyResponse:
        """Return some of the frequencies: a slice, a mask or ascending row numbers.

        Examples
        --------
        >>> fr = FrequencyResponse(w=[1, 2, 3], G=[3, 2, 1], coherence=[0.9, 0.9, 0.1])
        >>> fr.take(fr.coherent).w
        array([1., 2.])
        """
        part = rows if isinstance(rows, slice) else np.asarray(rows)

        def of(x: NDArray[Any] | None) -> NDArray[Any] | None:
            return None if x is None else x[part]

        return replace(
            self,
            w=self.w[part],
            G=self.G[part],
            sd=of(self.sd),
            radius=of(self.radius),
            coherence=of(self.coherence),
        )

    def between(self, low: float, high: float) -> FrequencyResponse:
        """Return the frequencies with `low <= w <= high`, rad/s.

        Examples
        --------
        >>> FrequencyResponse(w=[1, 2, 3], G=[3, 2, 1]).between(1.5, 9.0).w
        array([2., 3.])
        """
        return self.take((self.w >= low) & (self.w <= high))

    def bode(self, output: int = 0, input: int = 0) -> tuple[Band, Band]:
        """Return magnitude, and phase in degrees, with their bands; NaN where not coherent.

        Examples
        --------
        >>> magnitude, phase = FrequencyResponse(w=[1.0], G=[2j], radius=1.0).bode()
        >>> [x.round(6).tolist() for x in (*magnitude, *phase)]
        [[2.0], [1.0], [3.0], [90.0], [60.0], [120.0]]
        """
        magnitude, phase = _core.frequency_bode(self, output, input, self.coherent.tolist())
        return Band(*magnitude), Band(*phase)

    def same_as(self, other: Any) -> bool:
        """Whether the other response has the same numbers.

        Examples
        --------
        >>> a = FrequencyResponse(w=[1, 2], G=[1, 1j])
        >>> a.same_as(FrequencyResponse(w=[1, 2], G=[1, 1j]))
        True
        """
        if type(self) is not type(other) or self.Ts != other.Ts:
            return False
        pairs = [(getattr(self, n), getattr(other, n)) for n in ("w", "G", "radius", "coherence")]
        return all(
            a is b or (a is not None and b is not None and np.array_equal(a, b)) for a, b in pairs
        )

    def __str__(self) -> str:
        kind = "continuous" if self.Ts is None else f"sampled, Ts {self.Ts:g} s"
        head = f"Frequency response: {self.n} frequencies from {self.w[0]:.4g} to "
        head += f"{self.w[-1]:.4g} rad/s, {kind}"
        if self.ny * self.nu > 1:
            head += f", {self.ny} outputs, {self.nu} inputs"
        lines = [head] if not self.method else [head, f"  {self.method}"]
        return "\n".join([*lines, *(f"  {note}" for note in self.notes)])


def _points(G: ArrayLike, n: int) -> Complexes:
    """`G` as (n, ny, nu)."""
    points = np.array(G, np.complex128)
    points = points.reshape(-1, 1, 1) if points.ndim < 2 else points
    if points.ndim != 3 or len(points) != n or 0 in points.shape:
        raise refusal(
            "U01",
            f"`G` has shape {np.shape(G)}, must be ({n},) or ({n}, ny, nu) for {n} frequencies",
            where=("G", None, None),
            remedy="frequencies run along axis 0, then outputs, then inputs",
        )
    return np.ascontiguousarray(points)


def _discs(sd: Any, radius: Any, shape: tuple[int, ...]) -> dict[str, Floats | None]:
    """Return standard deviation and radius, each from the other where only one is given."""
    if sd is None and radius is None:
        return {"sd": None, "radius": None}
    factor = _core.disc_factor()
    if radius is None:
        sd = _spread(sd, "sd", shape)
        return {"sd": sd, "radius": sd * factor}
    radius = _spread(radius, "radius", shape)
    return {"sd": radius / factor if sd is None else _spread(sd, "sd", shape), "radius": radius}


def _spread(x: Any, name: str, shape: tuple[int, ...]) -> Floats:
    given = np.array(x, np.float64)
    if given.ndim == 1 and shape[1:] == (1, 1):
        given = given.reshape(-1, 1, 1)
    if given.ndim and given.shape != shape:
        raise refusal(
            "U01",
            f"`{name}` has shape {np.shape(x)}, G has {shape}",
            where=(name, None, None),
            remedy=f"give one {name} for all, or one for each point",
        )
    return np.ascontiguousarray(np.broadcast_to(given, shape)).copy()


def _share(x: float) -> float:
    if not 0 < x <= 1:
        raise refusal("U01", f"`share` is {x}, must lie in (0, 1]", remedy="leave it out: 1")
    return float(x)


def _coherence(x: Any, shape: tuple[int, ...]) -> Floats | None:
    if x is None:
        return None
    given = np.array(x, np.float64).reshape(len(x), -1)
    if given.shape != shape[:2] or not ((given >= 0) & (given <= 1)).all():
        raise refusal(
            "U01",
            f"`coherence` has shape {np.shape(x)} or leaves 0 to 1, must be {shape[:2]}",
            where=("coherence", None, None),
            remedy="one number from 0 to 1 for each frequency and output",
        )
    return given


def _names(names: Sequence[str], letter: str, n: int) -> tuple[str, ...]:
    if not names:
        return (letter,) if n == 1 else tuple(f"{letter}{i}" for i in range(1, n + 1))
    if len(names) != n:
        raise refusal("U01", f"`{letter}_names` has {len(names)} names, must be {n}")
    return tuple(names)
