"""Files of a run, all or none, tables, and refusals."""

from __future__ import annotations

import csv
import io
import json
import shutil
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from errno import EISDIR
from pathlib import Path
from typing import Any

import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.text import Text

from plantune import report
from plantune.errors import PlantuneError, refusal
from plantune.io import save_model, to_json, write_json, write_text
from plantune.job import Run

# Rows of an array up to which it is printed.
_LONGEST = 100


def write_run(folder: Path, run: Run) -> Path:
    """Write `report.html run.json model.json tuning.json`; nothing appears until all are there.

    A run without tunings has no `tuning.json`, and that of an older run is taken away.
    """
    with whole_folder(folder) as staging:
        report.write(staging / "report.html", run)
        save_model(staging / "model.json", run.chosen.model)
        write_json(staging / "run.json", run)
        if run.tunings:
            write_json(staging / "tuning.json", run.tunings[0])
        else:
            (folder / "tuning.json").unlink(missing_ok=True)
    return folder


@contextmanager
def whole_folder(folder: Path) -> Iterator[Path]:
    """Give a folder to write into, whose files then move to `folder`, all or none."""
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
    except OSError as error:
        raise _unwritable(folder, error) from None
    try:
        yield staging
        folder.mkdir(exist_ok=True)
        for file in staging.iterdir():  # first, so that no part is put in place
            if (folder / file.name).is_dir():
                raise IsADirectoryError(EISDIR, f"{file.name} is a directory")
        for file in staging.iterdir():
            file.replace(folder / file.name)
    except OSError as error:
        raise _unwritable(folder, error) from None
    finally:
        shutil.rmtree(staging, ignore_errors=True)


def write_file(out: Path, text: str, option: str = "--out") -> None:
    """Write a text; refuse where it cannot be written (R08)."""
    try:
        write_text(out, text)
    except OSError as error:
        raise _unwritable(out, error, option) from None


def _unwritable(out: Path, error: OSError, option: str = "--out") -> PlantuneError:
    return refusal(
        "R08", f"cannot write to {out}: {error.strerror}", remedy=f"choose another {option}"
    )


def csv_of(columns: Mapping[str, NDArray[Any]]) -> str:
    """Return columns as a table that `plantune.read` takes.

    What is not known, NaN, is an empty cell; what is true or not is 1 or 0.

    Examples
    --------
    >>> import numpy as np
    >>> print(csv_of({"t": np.array([0.0, 0.1]), "K": np.array([np.nan, 2.0])}), end="")
    t,K
    0.0,
    0.1,2.0
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(zip(*map(_cells, columns.values()), strict=True))
    return text.getvalue()


def _cells(x: NDArray[Any]) -> list[Any]:
    values: list[Any] = (x.astype(int) if x.dtype == bool else x).tolist()
    return [None if value != value else value for value in values]


@contextmanager
def refusing(as_json: bool) -> Iterator[None]:
    """Print a refusal of what is within, and exit with its code."""
    try:
        yield
    except PlantuneError as error:
        fail(error, as_json)
        raise typer.Exit(error.exit_code) from None


def fail(error: PlantuneError, as_json: bool, studied: dict[str, Any] | None = None) -> None:
    """Print a refusal: one JSON object, or at most three lines on standard error.

    The doubts found before it follow, a line each.  The fields of a partial run that was `studied`
    stand beside the error in JSON; as text that run has shown its doubts already.
    """
    if as_json:
        fields = {"error": to_json(as_dict(error)), **(studied or {})}
        print(json.dumps(fields, allow_nan=False))
        return
    console = Console(stderr=True, highlight=False, soft_wrap=True)
    first, *rest = str(error).splitlines()
    console.print(Text(first, style="bold red"))
    for line in rest:
        console.print(Text(line))
    for note in error.notes if studied is None else ():
        console.print(Text("found before: ", style="dim") + Text(str(note)))


def as_dict(error: PlantuneError) -> dict[str, Any]:
    """Return the fields of a refusal for JSON."""
    where = error.where
    return {
        "type": type(error).__name__,
        "code": error.code,
        "text": error.text,
        "where": where and dict(zip(("column", "row", "time"), where, strict=True)),
        "count": error.count,
        "measured": error.measured,
        "limit": error.limit,
        "remedy": error.remedy,
        "notes": error.notes,
    }


def as_fields(run: Run, folder: Path) -> dict[str, Any]:
    """Return the fields of a run for JSON, long arrays left to `run.json`."""
    return {**to_json(run, longest=_LONGEST), "out": str(folder)}


def print_json(fields: dict[str, Any]) -> None:
    """Print one JSON object."""
    sys.stdout.write(json.dumps(fields) + "\n")
