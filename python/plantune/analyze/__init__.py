"""A look at a record before a model is fitted."""

from plantune.analyze.delay import DelayScan, delay
from plantune.analyze.excitation import Excitation, InputExcitation, excitation
from plantune.analyze.health import Health, health
from plantune.analyze.noise import NoiseReport, noise
from plantune.analyze.response import Coherence, coherence, etfe, spa
from plantune.analyze.spectrum import Spectrum, spectrum

__all__ = [
    "Coherence",
    "DelayScan",
    "Excitation",
    "Health",
    "InputExcitation",
    "NoiseReport",
    "Spectrum",
    "coherence",
    "delay",
    "etfe",
    "excitation",
    "health",
    "noise",
    "spa",
    "spectrum",
]
