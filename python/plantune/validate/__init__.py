"""Whether a model holds on data that it has not seen."""

from plantune.validate.check import Residuals, Verdict, check
from plantune.validate.compare import Comparison, compare
from plantune.validate.trust import Trust, trust

__all__ = ["Comparison", "Residuals", "Trust", "Verdict", "check", "compare", "trust"]
