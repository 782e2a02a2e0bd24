"""Models of hysteresis as values."""

from plantune.models.hysteresis.play_stack import PlayStack
from plantune.models.hysteresis.series_slip import SeriesSlip

__all__ = ["PlayStack", "SeriesSlip"]
