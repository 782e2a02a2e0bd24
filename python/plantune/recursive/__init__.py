"""Estimators that learn one sample at a time, on line or over a record."""

from plantune._core import ARMAX, ARX, BJ, OE, RLS, Bank, InverseTransform, Recursion, TermARX
from plantune.recursive.trace import Trace

__all__ = [
    "ARMAX",
    "ARX",
    "BJ",
    "OE",
    "RLS",
    "Bank",
    "InverseTransform",
    "Recursion",
    "TermARX",
    "Trace",
]
