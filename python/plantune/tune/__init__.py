"""From a model to controller settings and their margins."""

from plantune.tune.bands import bode_band, step_band
from plantune.tune.imc import imc_pi
from plantune.tune.margins import Margins, Sensitivities, margins, sensitivities
from plantune.tune.tuning import Tuning

__all__ = [
    "Margins",
    "Sensitivities",
    "Tuning",
    "bode_band",
    "imc_pi",
    "margins",
    "sensitivities",
    "step_band",
]
