"""What is missing: sentinels, and the gap policies (D07)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from plantune.errors import refusal
from plantune.io.draft import Draft
from plantune.notes import Limits


def without_sentinels(draft: Draft, sentinels: Sequence[float]) -> Draft:
    """Count the values that stand for a missing one as missing."""
    for value in sentinels:
        found = draft.x == value
        if not found.any():
            continue
        counts = _counts(draft.names, found)
        draft = replace(
            draft,
            x=np.where(found, np.nan, draft.x),
            log=(*draft.log, f"{value:g} read as missing ({counts})"),
            causes=(*draft.causes, f"{value:g} {found.sum()}x"),
        )
    return draft


def refuse_missing(draft: Draft, columns: Sequence[int], remedy: str) -> None:
    """D07 where a value of these columns is missing."""
    missing = np.isnan(draft.x)
    counts = missing.sum(axis=0)
    gaps = [i for i in columns if counts[i]]
    if not gaps:
        return
    i = gaps[0]
    row = int(missing[:, i].argmax())
    also = f"; {len(gaps) - 1} further columns have gaps" if len(gaps) > 1 else ""
    raise refusal(
        "D07",
        f"`{draft.names[i]}` is missing in {counts[i]} of {draft.N} rows, "
        f"first in {draft.places.said(row)}{also}{_causes(draft)}",
        where=draft.where(row, draft.names[i]),
        count=int(counts[i]),
        measured=float(counts[i] / draft.N),
        limit=0.0,
        remedy=remedy,
    )


def marked(draft: Draft, outputs: range, limits: Limits) -> Draft:
    """Check that only outputs are missing; the record marks these rows itself."""
    others = [i for i in range(len(draft.names)) if i not in outputs]
    refuse_missing(draft, others, 'missing="mask" marks outputs only; missing="segments" cuts')
    missing = np.isnan(draft.x)
    _refuse_too_many_lost(draft, missing, limits)
    said = [
        f"`{name}` marked as missing in {n} of {draft.N} rows"
        for name, n in zip(draft.names, missing.sum(axis=0), strict=True)
        if n
    ]
    return replace(draft, log=(*draft.log, *said))


def cut(draft: Draft, limits: Limits) -> Draft:
    """Drop rows with a missing value; what follows a gap is a new segment."""
    missing = np.isnan(draft.x)
    keep = np.logical_not(missing.any(axis=1))
    if keep.all():
        return draft
    _refuse_too_many_lost(draft, missing, limits)
    draft = replace(draft, segment=draft.segment + np.cumsum(~keep))  # grows over each gap
    kept = draft.take(keep, "")
    said = (
        f"dropped {(~keep).sum()} of {draft.N} rows with missing values "
        f"({_counts(draft.names, missing)}), {len(kept.starts)} segments remain"
    )
    return replace(kept, log=(*draft.log, said))


def _refuse_too_many_lost(draft: Draft, missing: NDArray[np.bool_], limits: Limits) -> None:
    lost = missing.any(axis=1)
    share = float(lost.mean())
    if share <= limits.D07:
        return
    row = int(lost.argmax())
    raise refusal(
        "D07",
        f"values are missing in {lost.sum()} of {draft.N} rows, "
        f"first in {draft.places.said(row)}{_causes(draft)}",
        where=draft.where(row, draft.names[int(missing[row].argmax())]),
        count=int(lost.sum()),
        measured=share,
        limit=limits.D07,
        remedy="record again, or choose other columns",
    )


def _counts(names: Sequence[str], found: NDArray[np.bool_]) -> str:
    counts = zip(names, found.sum(axis=0), strict=True)
    return ", ".join(f"{name} {n}" for name, n in counts if n)


def _causes(draft: Draft) -> str:
    return f" ({', '.join(draft.causes)})" if draft.causes else ""
