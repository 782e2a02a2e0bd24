"""Tables that a page shows are those of its example."""

import importlib.util
import re
from functools import partial
from pathlib import Path

import pytest
from pytest import approx

ROOT = Path(__file__).resolve().parents[2]


def example(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / "examples" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_which_method_shows_the_errors_of_its_example():
    page = (ROOT / "docs" / "which-method.md").read_text(encoding="utf-8")
    shown = {
        kind: iter(re.findall(r"[-+]?\d+\.\d", cells))
        for kind, cells in re.findall(r"^\| ((?:open|closed), .*?) \|(.*)\|$", page, re.M)
    }
    for kind, name, mean, spread in example("which_method").errors():
        ours = [mean[0], spread[0], mean[1], spread[1]]
        # A unit of the decimal shown: half of it is rounding, the rest what machines differ by.
        assert [float(next(shown[kind])) for _ in ours] == approx(ours, abs=0.1), (kind, name)
    assert all(next(rest, None) is None for rest in shown.values())


def shown(page, row):
    """Return the numbers of a row of a table; `never` is infinite."""
    (cells,) = re.findall(rf"^\| {re.escape(row)} \|(.*)\|$", page, re.M)
    return [float(x) for x in re.findall(r"\d+(?:\.\d+)?|inf", cells.replace("never", "inf"))]


# Two units of the last decimal shown, and 2 %: machines round differently what is counted.
close = partial(approx, rel=0.02, abs=0.02)


@pytest.mark.slow
def test_source_001_shows_the_numbers_of_its_example():
    page = (ROOT / "docs" / "sources" / "001-autotuner.md").read_text(encoding="utf-8")
    tuner = example("source_001_autotuner")
    for name, ours in tuner.convergence():
        assert shown(page, name) == close(list(ours)), name
    for t, ours in tuner.noisy():
        assert shown(page, f"{t:g} s") == close(list(ours.ravel())), t


@pytest.mark.slow
def test_which_recursion_shows_the_tables_of_its_example():
    page = (ROOT / "docs" / "questions" / "which-recursion.md").read_text(encoding="utf-8")
    recursion = example("which_recursion")
    for name, ours in recursion.errors():
        assert shown(page, name) == close([x for pair in ours for x in pair]), name
    for name, ours in recursion.followed():
        assert shown(page, name) == approx(list(ours), rel=0.02, abs=0.05), name


def test_source_002_shows_the_tables_of_its_example():
    page = (ROOT / "docs" / "sources" / "002.md").read_text(encoding="utf-8")
    stage = example("source_002")
    for consecutive, cells in stage.noisy():
        assert shown(page, str(consecutive)) == close(cells), consecutive
    for (drift, threshold), cells in stage.second():
        assert shown(page, f"{drift}, {threshold}") == close(cells), (drift, threshold)
    for name, cells in stage.compensated():
        assert shown(page, name) == close(cells), name


def test_links_between_pages_lead_somewhere():
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    for page in pages:
        text = page.read_text(encoding="utf-8")
        for target in re.findall(r"\]\(([^)#]*)(?:#[^)]*)?\)", text):
            if target and "://" not in target:
                assert (page.parent / target).exists(), f"{page.relative_to(ROOT)}: {target}"
