"""One self-contained HTML page from a run of the main job."""

from plantune.report.write import write

__all__ = ["write"]
