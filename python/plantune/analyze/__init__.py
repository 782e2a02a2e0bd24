"""A look at a record before a model is fitted."""

from plantune.analyze.compression import Compression, OutputCompression, compression
from plantune.analyze.delay import DelayScan, delay
from plantune.analyze.delay_evidence import DelayEvidence, OEScan, delay_evidence
from plantune.analyze.excitation import Excitation, InputExcitation, excitation
from plantune.analyze.experiment import Experiment, Prediction, experiment, predicted_sd
from plantune.analyze.health import Health, health
from plantune.analyze.impulse import ImpulseResponse, impulse
from plantune.analyze.informative import Informative, InformativeStretch, informative
from plantune.analyze.noise import NoiseReport, noise
from plantune.analyze.offset_steps import OffsetSteps, offset_steps
from plantune.analyze.response import Coherence, coherence, etfe, spa
from plantune.analyze.spectrum import Spectrum, spectrum
from plantune.analyze.xcorr import Correlation, xcorr

__all__ = [
    "Coherence",
    "Compression",
    "Correlation",
    "DelayEvidence",
    "DelayScan",
    "Excitation",
    "Experiment",
    "Health",
    "ImpulseResponse",
    "Informative",
    "InformativeStretch",
    "InputExcitation",
    "NoiseReport",
    "OEScan",
    "OffsetSteps",
    "OutputCompression",
    "Prediction",
    "Spectrum",
    "coherence",
    "compression",
    "delay",
    "delay_evidence",
    "etfe",
    "excitation",
    "experiment",
    "health",
    "impulse",
    "informative",
    "noise",
    "offset_steps",
    "predicted_sd",
    "spa",
    "spectrum",
    "xcorr",
]
