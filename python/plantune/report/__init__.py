"""Self-contained HTML pages: a run of the main job, rules on a model, a look at a record."""

from plantune.report.write import write, write_comparison, write_inspection

__all__ = ["write", "write_comparison", "write_inspection"]
