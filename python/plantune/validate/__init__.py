"""Whether a model holds on data that it has not seen."""

from plantune.validate.check import Residuals, Verdict, check
from plantune.validate.compare import Comparison, compare

__all__ = ["Comparison", "Residuals", "Verdict", "check", "compare"]
