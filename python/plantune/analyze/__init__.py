"""A look at a record before a model is fitted."""

from plantune.analyze.delay import DelayScan, delay
from plantune.analyze.delay_evidence import DelayEvidence, OEScan, delay_evidence
from plantune.analyze.experiment import Experiment, Prediction, experiment, predicted_sd
from plantune.analyze.health import Health, health
from plantune.analyze.impulse import ImpulseResponse, impulse
from plantune.analyze.informative import Informative, InformativeStretch, informative
from plantune.analyze.offset_steps import OffsetSteps, offset_steps
from plantune.analyze.xcorr import Correlation, xcorr

__all__ = [
    "Correlation",
    "DelayEvidence",
    "DelayScan",
    "Experiment",
    "Health",
    "ImpulseResponse",
    "Informative",
    "InformativeStretch",
    "OEScan",
    "OffsetSteps",
    "Prediction",
    "delay",
    "delay_evidence",
    "experiment",
    "health",
    "impulse",
    "informative",
    "offset_steps",
    "predicted_sd",
    "xcorr",
]
