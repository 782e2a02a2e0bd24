"""Models of hysteresis as values."""

from plantune.models.hysteresis.asymmetric_stack import AsymmetricInverse, AsymmetricStack
from plantune.models.hysteresis.even_stack import EvenStack
from plantune.models.hysteresis.play_stack import PlayStack
from plantune.models.hysteresis.series_slip import SeriesSlip

__all__ = ["AsymmetricInverse", "AsymmetricStack", "EvenStack", "PlayStack", "SeriesSlip"]
