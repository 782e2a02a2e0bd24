"""A look at a record before a model is fitted."""

from plantune.analyze.delay import DelayScan, delay
from plantune.analyze.health import Health, health

__all__ = ["DelayScan", "Health", "delay", "health"]
