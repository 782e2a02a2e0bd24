"""From a model to controller settings and their margins."""

from plantune.tune.amigo import amigo
from plantune.tune.bands import bode_band, step_band
from plantune.tune.chien_hrones_reswick import chien_hrones_reswick
from plantune.tune.cohen_coon import cohen_coon
from plantune.tune.compare import Comparison, Row, compare
from plantune.tune.half_rule import controllability_ratio, half_rule
from plantune.tune.imc import IMC, Costs, imc, imc_costs, tracking_cost
from plantune.tune.imc_pi import imc_pi
from plantune.tune.imc_pid import imc_pid
from plantune.tune.jsonfile import load_tuning, save_tuning, tuning_of
from plantune.tune.lambda_ import lambda_
from plantune.tune.loop_shape import loop_shape
from plantune.tune.loop_transfers import LoopTransfers, loop_transfers
from plantune.tune.margins import Margins, Sensitivities, margins, sensitivities
from plantune.tune.optimal import optimal
from plantune.tune.precontrol import precontrol
from plantune.tune.refined_ziegler_nichols import refined_ziegler_nichols
from plantune.tune.relay import RelayTest, relay
from plantune.tune.robustness import Robustness, robustness
from plantune.tune.simc import simc
from plantune.tune.simc_plus import simc_plus
from plantune.tune.stability import Stability, stability
from plantune.tune.tuning import Tuning
from plantune.tune.tyreus_luyben import tyreus_luyben
from plantune.tune.ziegler_nichols import ziegler_nichols

__all__ = [
    "IMC",
    "Comparison",
    "Costs",
    "LoopTransfers",
    "Margins",
    "RelayTest",
    "Robustness",
    "Row",
    "Sensitivities",
    "Stability",
    "Tuning",
    "amigo",
    "bode_band",
    "chien_hrones_reswick",
    "cohen_coon",
    "compare",
    "controllability_ratio",
    "half_rule",
    "imc",
    "imc_costs",
    "imc_pi",
    "imc_pid",
    "lambda_",
    "load_tuning",
    "loop_shape",
    "loop_transfers",
    "margins",
    "optimal",
    "precontrol",
    "refined_ziegler_nichols",
    "relay",
    "robustness",
    "save_tuning",
    "sensitivities",
    "simc",
    "simc_plus",
    "stability",
    "step_band",
    "tracking_cost",
    "tuning_of",
    "tyreus_luyben",
    "ziegler_nichols",
]
