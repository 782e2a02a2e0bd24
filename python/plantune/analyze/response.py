"""Frequency response and coherence of a record, without a model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from plantune import _core
from plantune.models import FrequencyResponse
from plantune.notes import DEFAULT_LIMITS, Limits, Note, notes_from_core
from plantune.record import Floats, Record


def etfe(
    rec: Record,
    *,
    half: int | None = None,
    memory: float | None = None,
    limits: Limits | None = None,
) -> FrequencyResponse:
    """Estimate G = Y(w)/U(w), smoothed over neighbouring frequencies.

    Parameters
    ----------
    rec : Record
        Any number of inputs and outputs; the longest stretch of rows that count is used.
    half : int, optional
        Neighbours on either side, with Hann weights; 0 for the ratio itself, which is right for
        whole periods of a periodic input and has no band.  By default as many as the plant's
        memory allows.
    memory : float, optional
        `T + L` of the plant, seconds, where it is known; else a quick ARX model tells it.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    FrequencyResponse
        At every frequency of the record where the inputs have power; its discs hold 95 %.

    Raises
    ------
    NotIdentifiable
        An input stands still (X01), fewer than 16 rows (X03).
    UsageError
        `half` beyond an eighth of the rows; `half=0` with several inputs (U01).

    Notes
    -----
    Source 001, 3.5.5 and (3.5-38); Ljung 1999, 6.3.  For a record of many times `20 (T + L)`
    prefer `spa`.

    Examples
    --------
    >>> import plantune as pt
    >>> fr = etfe(pt.datasets.hair_dryer())
    >>> print(fr)
    Frequency response: 500 frequencies from 0.07854 to 39.27 rad/s, sampled, Ts 0.08 s
      ETFE smoothed over 11 lines, Hann weights
    """
    return _response(rec, _way("lines", half=half), memory, limits)


def spa(
    rec: Record,
    *,
    method: str = "auto",
    n: int | None = None,
    overlap: float = 0.5,
    window: str = "hann",
    M: int | None = None,
    memory: float | None = None,
    limits: Limits | None = None,
) -> FrequencyResponse:
    """Estimate G = S_yu S_u^-1 from averaged spectra, with a disc around each point.

    Parameters
    ----------
    rec : Record
        Any number of inputs and outputs; segments and `valid` are honoured.
    method : "auto", "welch" or "bt"
        Welch's overlapping stretches, or the lag window of Blackman and Tukey.  "auto" takes
        Welch where the record has eight times `20 (T + L)`, else averaged lines as `etfe`.
    n, overlap, window
        Stretches of Welch's way, as of `analyze.spectrum`; `n` is by default the power of two from
        `20 (T + L)` on, at most an eighth of the rows.  Given `n` makes "auto" Welch.
    M : int, optional
        Lags of the lag window; by default `18 (T + L)`.
    memory : float, optional
        `T + L` of the plant, seconds, where it is known; else a quick ARX model tells it.
    limits : Limits, optional
        Thresholds.

    Returns
    -------
    FrequencyResponse
        `coherence` beside the points: below one half a point says more of the disturbance than of
        the plant.  Note X04 where most are.

    Raises
    ------
    NotIdentifiable
        An input stands still (X01), a stretch longer than the record (X03).

    Notes
    -----
    The discs hold their 95 % as long as the window is wide against the plant's memory; what they
    miss is bias.  In closed loop a disturbance goes round through the controller, and what is
    estimated lies between the plant and `-1/C`.  Bendat and Piersol 2010, (9.94); Ljung 1999, 6.4.

    Examples
    --------
    >>> import plantune as pt
    >>> fr = spa(pt.datasets.hair_dryer(), method="welch", n=128)
    >>> fr.n, int(fr.coherent.sum())
    (64, 27)
    """
    return _response(rec, _spa_way(method, n, overlap, window, M), memory, limits)


@dataclass(frozen=True, slots=True, eq=False)
class Coherence:
    """The share of each output's power that each input explains, over frequency.

    Attributes
    ----------
    w : array (n,)
        Frequencies, rad/s.
    value, low, high : array (n, ny, nu)
        Ordinary coherence of output i with input j, and its 95 % band.
    multiple : array (n, ny)
        Coherence of output i with all inputs together.
    limit : float
        What chance exceeds in one case of twenty where there is none.
    method : str
        What was averaged.
    u_names, y_names : tuple of str
        Names.
    notes : tuple of Note
        Doubts.
    source : str
        Fingerprint of the record.

    Examples
    --------
    >>> import plantune as pt
    >>> print(pt.analyze.coherence(pt.datasets.hair_dryer(), n=128))
    Coherence: above one half at 27 of 64 frequencies, from 0.9817 to 39.27 rad/s
      Welch: 14 stretches of 128 rows, Hann window, 50 % overlap
      X04 the coherence is below one half at 58 % of the frequencies - look at what is left; a \
faster or larger input, or a longer record, shows more
    """

    w: Floats
    value: Floats
    low: Floats
    high: Floats
    multiple: Floats
    limit: float
    method: str
    u_names: tuple[str, ...]
    y_names: tuple[str, ...]
    notes: tuple[Note, ...]
    source: str

    def __str__(self) -> str:
        high = int((self.multiple >= 0.5).all(axis=1).sum())
        head = (
            f"Coherence: above one half at {high} of {len(self.w)} frequencies, "
            f"from {self.w[0]:.4g} to {self.w[-1]:.4g} rad/s"
        )
        return "\n".join([head, f"  {self.method}", *(f"  {note}" for note in self.notes)])


def coherence(
    rec: Record,
    *,
    method: str = "auto",
    n: int | None = None,
    overlap: float = 0.5,
    window: str = "hann",
    M: int | None = None,
    memory: float | None = None,
    limits: Limits | None = None,
) -> Coherence:
    """Say at which frequencies the outputs follow the inputs: |S_yu|^2/(S_u S_y).

    Parameters
    ----------
    rec, method, n, overlap, window, M, memory, limits
        As of `analyze.spa`.

    Returns
    -------
    Coherence

    Raises
    ------
    NotIdentifiable
        As `analyze.spa`.

    Notes
    -----
    One of two things lowers it: a disturbance, or a relation that is not linear.  Bendat and
    Piersol 2010, 9.2.

    Examples
    --------
    >>> import plantune as pt
    >>> found = coherence(pt.datasets.hair_dryer(), n=128)
    >>> bool(found.value[0] > 0.9), bool(found.value[-1] < 0.5), round(found.limit, 2)
    (True, True, 0.21)
    """
    limits = limits or rec.limits or DEFAULT_LIMITS
    d = _core.coherence(rec, _spa_way(method, n, overlap, window, M), memory, limits)
    shape = (len(d["w"]), rec.ny, rec.nu)
    curves = {name: d[name].reshape(shape) for name in ("value", "low", "high")}
    return Coherence(
        w=d["w"],
        **curves,
        multiple=d["multiple"].reshape(shape[:2]),
        limit=d["limit"],
        method=d["method"],
        u_names=rec.u_names,
        y_names=rec.y_names,
        notes=(*notes_from_core(d["notes"]), *limits.changes()),
        source=rec.source,
    )


def _spa_way(
    method: str, n: int | None, overlap: float, window: str, M: int | None
) -> dict[str, Any]:
    if method == "auto" and n is not None:
        method = "welch"
    if method == "auto" and M is not None:
        method = "bt"
    return _way(method, n=n, overlap=overlap, window=window, M=M)


def _way(method: str, **numbers: Any) -> dict[str, Any]:
    usual = {"n": None, "overlap": 0.5, "window": "hann", "M": None, "half": None}
    return {"method": method, **usual, **numbers}


def _response(
    rec: Record, way: dict[str, Any], memory: float | None, limits: Limits | None
) -> FrequencyResponse:
    limits = limits or rec.limits or DEFAULT_LIMITS
    d = _core.response(rec, way, memory, limits)
    shape = (len(d["w"]), rec.ny, rec.nu)

    def shaped(name: str, to: tuple[int, ...]) -> Any:
        return None if d[name] is None else d[name].reshape(to)

    return FrequencyResponse(
        w=d["w"],
        G=d["G"].reshape(shape),
        Ts=rec.Ts,
        sd=shaped("sd", shape),
        radius=shaped("radius", shape),
        coherence=shaped("coherence", shape[:2]),
        share=d["share"],
        u_names=rec.u_names,
        y_names=rec.y_names,
        method=d["method"],
        notes=(*notes_from_core(d["notes"]), *limits.changes()),
        source=rec.source,
    )
