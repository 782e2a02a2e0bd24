"""Preparation: a record in, a record out, with a line in its log."""

from plantune._core import Butterworth
from plantune.prep.butter import bandpass, highpass, lowpass
from plantune.prep.detrend import detrend
from plantune.prep.resample import resample

__all__ = ["Butterworth", "bandpass", "detrend", "highpass", "lowpass", "resample"]
