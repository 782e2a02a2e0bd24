"""Tables that a page shows are those of its example."""

import importlib.util
import re
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


@pytest.mark.slow
def test_source_001_shows_the_numbers_of_its_example():
    page = (ROOT / "docs" / "sources" / "001-autotuner.md").read_text(encoding="utf-8")
    tuner = example("source_001_autotuner")

    def shown(row):
        (cells,) = re.findall(rf"^\| {re.escape(row)} \|(.*)\|$", page, re.M)
        return [float(x) for x in re.findall(r"\d+(?:\.\d+)?|inf", cells.replace("never", "inf"))]

    for name, ours in tuner.convergence():
        # Two units of the last decimal shown: medians of what machines round differently.
        assert shown(name) == approx(list(ours), rel=0.02, abs=0.02), name
    for t, ours in tuner.noisy():
        assert shown(f"{t:g} s") == approx(list(ours.ravel()), abs=0.02), t


def test_links_between_pages_lead_somewhere():
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    for page in pages:
        text = page.read_text(encoding="utf-8")
        for target in re.findall(r"\]\(([^)#]*)(?:#[^)]*)?\)", text):
            if target and "://" not in target:
                assert (page.parent / target).exists(), f"{page.relative_to(ROOT)}: {target}"
