"""A look at a record before a model is fitted."""

from plantune.analyze.delay import DelayScan, delay

__all__ = ["DelayScan", "delay"]
