"""A look at a record before a model is fitted."""

from plantune.analyze.delay import DelayScan, delay
from plantune.analyze.health import Health, health
from plantune.analyze.impulse import ImpulseResponse, impulse

__all__ = ["DelayScan", "Health", "ImpulseResponse", "delay", "health", "impulse"]
