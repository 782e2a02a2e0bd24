"""A look at a record before a model is fitted."""

from plantune.analyze.delay import DelayScan, delay
from plantune.analyze.delay_evidence import DelayEvidence, OEScan, delay_evidence
from plantune.analyze.health import Health, health
from plantune.analyze.impulse import ImpulseResponse, impulse
from plantune.analyze.xcorr import Correlation, xcorr

__all__ = [
    "Correlation",
    "DelayEvidence",
    "DelayScan",
    "Health",
    "ImpulseResponse",
    "OEScan",
    "delay",
    "delay_evidence",
    "health",
    "impulse",
    "xcorr",
]
