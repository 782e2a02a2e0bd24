"""Estimation: a record in, a fitted model with its uncertainty out."""

from plantune.estimate.arx import arx
from plantune.estimate.candidates import candidates
from plantune.estimate.fit import Fit
from plantune.estimate.least_squares import least_squares
from plantune.estimate.pem import armax, oe
from plantune.estimate.process import process

__all__ = ["Fit", "armax", "arx", "candidates", "least_squares", "oe", "process"]
