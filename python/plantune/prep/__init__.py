"""Preparation: a record in, a record out, with a line in its log."""

from plantune.prep.despike import despike
from plantune.prep.detrend import detrend
from plantune.prep.resample import resample

__all__ = ["despike", "detrend", "resample"]
