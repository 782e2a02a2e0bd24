"""Hysteresis: models, operators sample by sample, inverses, identification."""

from plantune._core import Stream
from plantune.models.hysteresis import PlayStack

__all__ = ["PlayStack", "Stream"]
