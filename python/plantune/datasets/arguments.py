"""What the simulations share: their arguments looked over."""

from __future__ import annotations

from plantune.errors import refusal


def check_arguments(
    at_least_zero: dict[str, float], t_end: float, shortest: float, longest: float
) -> None:
    """Refuse negative variances and seeds, and a length out of its range (U01)."""
    for name, value in at_least_zero.items():
        if not value >= 0:
            raise refusal(
                "U01", f"`{name}` is {value}, must be zero or positive", remedy=f"{name}=0"
            )
    if not shortest <= t_end <= longest:
        raise refusal(
            "U01",
            f"`t_end` is {t_end}, must be from {shortest} to {longest:g} seconds",
            remedy=f"t_end={10 * shortest:g}",
        )
