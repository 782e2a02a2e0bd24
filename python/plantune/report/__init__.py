"""Self-contained HTML pages: a run of the main job, and a comparison of rules on a model."""

from plantune.report.write import write, write_comparison

__all__ = ["write", "write_comparison"]
