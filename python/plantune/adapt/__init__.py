"""The auto-tuner: it identifies, tunes and gates while the plant runs; source 001, 3.7."""

from plantune.adapt.collect import collect
from plantune.adapt.decision import Decision, Sample
from plantune.adapt.log import AdaptLog
from plantune.adapt.replay import replay
from plantune.adapt.settings import BankSettings, Settings
from plantune.adapt.tuner import AutoTuner

__all__ = [
    "AdaptLog",
    "AutoTuner",
    "BankSettings",
    "Decision",
    "Sample",
    "Settings",
    "collect",
    "replay",
]
