"""Writes the page, whole or not at all."""

from __future__ import annotations

import os
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING

from plantune.plot.embed import library
from plantune.report import sections
from plantune.report.comparison import of_comparison
from plantune.report.figures import figures
from plantune.report.inspection import of_inspection
from plantune.report.models import model
from plantune.report.text import escaped

if TYPE_CHECKING:
    from plantune.inspection import Inspection
    from plantune.job import Run
    from plantune.tune import Comparison

# Nothing may be loaded from anywhere: what the page needs is in it.
_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
    "img-src data: blob:; font-src data:; base-uri 'none'; form-action 'none'"
)


def write(path: str | os.PathLike[str], run: Run) -> Path:
    """Write the report of a run as one HTML file that works off line.

    Parameters
    ----------
    path : path
        The file; an older one is replaced once the new one is complete.
    run : Run
        From `job.run`.

    Returns
    -------
    Path
        Where it was written.

    Examples
    --------
    >>> import tempfile
    >>> import plantune as pt
    >>> run = pt.job.run(pt.datasets.hair_dryer())
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     page = write(Path(folder, "report.html"), run).read_text(encoding="utf-8")
    >>> page.startswith("<!doctype html>"), "http-equiv" in page
    (True, True)
    """
    parts = [
        sections.head(run),
        sections.notes(run),
        sections.settings(run),
        sections.rules(run),
        model(run),
        figures(run),
        sections.indices(run),
        sections.provenance(run),
    ]
    return _whole(path, _page(run.title, parts))


def write_comparison(
    path: str | os.PathLike[str], comparison: Comparison, title: str = "Rules compared"
) -> Path:
    """Write the comparison of rules on one model as one HTML file that works off line.

    Parameters
    ----------
    path : path
        The file; an older one is replaced once the new one is complete.
    comparison : Comparison
        From `tune.compare`; the first rule is drawn in full.
    title : str
        What the plant is called.

    Returns
    -------
    Path
        Where it was written.

    Examples
    --------
    >>> import tempfile
    >>> import plantune as pt
    >>> both = pt.tune.compare(pt.models.ProcessModel(K=2.0, T=5.0, L=1.0))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     page = write_comparison(Path(folder, "page.html"), both).read_text(encoding="utf-8")
    >>> "SIMC" in page
    True
    """
    return _whole(path, _page(title, of_comparison(comparison, title)))


def write_inspection(
    path: str | os.PathLike[str], seen: Inspection, title: str | None = None
) -> Path:
    r"""Write what a look has shown as one HTML file that works off line.

    Parameters
    ----------
    path : path
        The file; an older one is replaced once the new one is complete.
    seen : Inspection
        From `inspect`.
    title : str, optional
        What the plant is called; the name of the file without it.

    Returns
    -------
    Path
        Where it was written.

    Examples
    --------
    >>> import tempfile
    >>> import plantune as pt
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     data = Path(folder, "heater.csv")
    ...     _ = data.write_text("time,power,temp\n0.0,1,20.0\n0.5,2,21.0\n1.0,2,21.5\n")
    ...     page = write_inspection(Path(folder, "inspection.html"), pt.inspect(data))
    ...     "heater" in page.read_text(encoding="utf-8")
    True
    """
    title = title or Path(seen.name).stem
    return _whole(path, _page(title, of_inspection(seen, title)))


def _whole(path: str | os.PathLike[str], page: str) -> Path:
    """Write a page whole or not at all."""
    path = Path(path)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        part.write_text(page, encoding="utf-8")
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
    return path


def _page(title: str, parts: list[str]) -> str:
    """Put the sections together, top down."""
    body = "\n".join(part for part in parts if part)
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{_POLICY}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{escaped(title)} – plantune</title>
<link rel="icon" href="data:,">
<style>
{_asset("page.css")}</style>
</head>
<body>
{body}
<script>{library()}</script>
<script>
{_asset("page.js")}</script>
</body>
</html>
"""


def _asset(name: str) -> str:
    return files("plantune.report").joinpath(name).read_text(encoding="utf-8")
