"""Models of hysteresis as values."""

from plantune.models.hysteresis.play_stack import PlayStack

__all__ = ["PlayStack"]
