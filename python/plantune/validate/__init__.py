"""Whether a model holds on data that it has not seen."""

from plantune.validate.check import Residuals, Verdict, check
from plantune.validate.compare import Comparison, compare
from plantune.validate.plausible import plausible
from plantune.validate.smoothing import Smoothing, Treatment, smoothing
from plantune.validate.trust import Trust, trust

__all__ = [
    "Comparison",
    "Residuals",
    "Smoothing",
    "Treatment",
    "Trust",
    "Verdict",
    "check",
    "compare",
    "plausible",
    "smoothing",
    "trust",
]
