"""A look at a record before a model is fitted."""

from plantune.analyze.delay import DelayScan, delay
from plantune.analyze.experiment import Experiment, Prediction, experiment, predicted_sd
from plantune.analyze.health import Health, health
from plantune.analyze.impulse import ImpulseResponse, impulse
from plantune.analyze.informative import Informative, InformativeStretch, informative

__all__ = [
    "DelayScan",
    "Experiment",
    "Health",
    "ImpulseResponse",
    "Informative",
    "InformativeStretch",
    "Prediction",
    "delay",
    "experiment",
    "health",
    "impulse",
    "informative",
    "predicted_sd",
]
