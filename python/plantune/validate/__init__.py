"""Whether a model holds on data that it has not seen."""

from plantune.validate.check import Residuals, Verdict, check, residuals
from plantune.validate.closed_loop import ClosedLoop, closed_loop
from plantune.validate.compare import Comparison, compare
from plantune.validate.frequency import FrequencyVerdict, frequency
from plantune.validate.plausible import plausible
from plantune.validate.smoothing import Smoothing, Treatment, smoothing
from plantune.validate.time_varying import TimeVarying, time_varying
from plantune.validate.trust import Trust, trust

__all__ = [
    "ClosedLoop",
    "Comparison",
    "FrequencyVerdict",
    "Residuals",
    "Smoothing",
    "TimeVarying",
    "Treatment",
    "Trust",
    "Verdict",
    "check",
    "closed_loop",
    "compare",
    "frequency",
    "plausible",
    "residuals",
    "smoothing",
    "time_varying",
    "trust",
]
