"""Figures of records, models and loops: each takes results and draws them, computing nothing."""

from plantune.plot.adapt import adapt
from plantune.plot.bode import bode
from plantune.plot.closed_loop import closed_loop
from plantune.plot.compare import compare
from plantune.plot.delay import delay
from plantune.plot.delay_evidence import delay_evidence
from plantune.plot.experiment import experiment
from plantune.plot.forc import forc
from plantune.plot.frequency import frequency
from plantune.plot.hysteresis import hysteresis
from plantune.plot.impulse import impulse
from plantune.plot.margins import margins
from plantune.plot.noise import noise
from plantune.plot.record import record
from plantune.plot.relay import relay
from plantune.plot.residuals import residuals
from plantune.plot.robustness import robustness
from plantune.plot.rules import rules
from plantune.plot.spectrum import spectrum
from plantune.plot.step import step
from plantune.plot.step_modes import step_modes
from plantune.plot.stretches import stretches
from plantune.plot.tracking import tracking

__all__ = [
    "adapt",
    "bode",
    "closed_loop",
    "compare",
    "delay",
    "delay_evidence",
    "experiment",
    "forc",
    "frequency",
    "hysteresis",
    "impulse",
    "margins",
    "noise",
    "record",
    "relay",
    "residuals",
    "robustness",
    "rules",
    "spectrum",
    "step",
    "step_modes",
    "stretches",
    "tracking",
]
