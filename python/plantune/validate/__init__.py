"""Whether a model holds on data that it has not seen."""

from plantune.validate.check import Residuals, Verdict, check

__all__ = ["Residuals", "Verdict", "check"]
