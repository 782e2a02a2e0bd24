"""A look at a record before a model is fitted."""

from plantune.analyze.delay import DelayScan, delay
from plantune.analyze.experiment import Experiment, Prediction, experiment, predicted_sd
from plantune.analyze.health import Health, health

__all__ = [
    "DelayScan",
    "Experiment",
    "Health",
    "Prediction",
    "delay",
    "experiment",
    "health",
    "predicted_sd",
]
