"""The main job: a record becomes a validated model, settings with margins, and a loop."""

from plantune.job.outcome import Run as Run
from plantune.job.study import run as run
