"""Models as values; they print as equations and answer questions through the core."""

from plantune.models.convert import c2d, d2c
from plantune.models.forms import Form, Nearest
from plantune.models.frequency_response import FrequencyResponse
from plantune.models.matrix_poly import MatrixPolyModel
from plantune.models.pid import PID
from plantune.models.poly import PolyModel
from plantune.models.process import ProcessModel
from plantune.models.state_space import Reduction, StateSpace
from plantune.models.terms import TermModel
from plantune.models.transfer import TransferFunction

__all__ = [
    "PID",
    "Form",
    "FrequencyResponse",
    "MatrixPolyModel",
    "Nearest",
    "PolyModel",
    "ProcessModel",
    "Reduction",
    "StateSpace",
    "TermModel",
    "TransferFunction",
    "c2d",
    "d2c",
]
