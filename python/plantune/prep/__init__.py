"""Preparation: a record in, a record out, with a line in its log."""

from plantune._core import Butterworth
from plantune.prep.butter import bandpass, highpass, lowpass
from plantune.prep.despike import despike
from plantune.prep.detrend import detrend
from plantune.prep.exclude import exclude
from plantune.prep.resample import resample
from plantune.prep.smooth import smooth
from plantune.prep.stretches import moving, steady

__all__ = [
    "Butterworth",
    "bandpass",
    "despike",
    "detrend",
    "exclude",
    "highpass",
    "lowpass",
    "moving",
    "resample",
    "smooth",
    "steady",
]
