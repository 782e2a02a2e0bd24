"""The page of a look is one file, says what to do first, and lets no name act."""

import json
import re

import numpy as np
import pytest

import plantune as pt
from plantune import report
from plantune.plot.embed import library

EVIL = "</script><script>alert(1)</script>"


def written(tmp_path, columns, **options):
    data = tmp_path / "heater.csv"
    rows = (",".join(repr(float(x)) for x in row) for row in zip(*columns.values(), strict=True))
    lines = [",".join(columns), *rows]
    data.write_text("\n".join(lines) + "\n", encoding="utf-8")
    seen = pt.inspect(data, **options)
    return seen, report.write_inspection(tmp_path / "page.html", seen).read_text(encoding="utf-8")


def heater(N=600, seed=1):
    u = pt.signals.prbs(N, hold=12)
    y = pt.models.ProcessModel(K=2.0, T=8.0, L=3.4).simulate(u, Ts=1.0)
    y += np.random.default_rng(seed).normal(0, 0.05, N)
    return {"time": np.arange(N), "power": u, "temp": y}


@pytest.fixture(scope="module")
def look(tmp_path_factory):
    return written(tmp_path_factory.mktemp("look"), heater(), u="power", y="temp")


def test_everything_a_person_looks_at_is_there_in_order(look):
    _, page = look
    ids = re.findall(r' id="([^"]+)"', page)
    wanted = ["next", "found", "figures", "figure-record", "figure-impulse-0", "figure-response-0",
              "figure-delay-0", "figure-noise-0", "figure-spectrum-0", "files"]  # fmt: skip
    assert [name for name in ids if name in wanted] == wanted
    assert len(ids) == len(set(ids))


def test_the_next_command_is_said_first(look):
    seen, page = look
    command = "plantune tune heater.csv --u power --y temp"
    assert seen.steps[-1] == f"Identify and tune: `{command}`"
    assert page.index(f"<code>{command}</code>") < page.index('<section id="found">')


def test_the_plant_is_seen_without_a_model(look):
    seen, _ = look
    assert seen.delay["power"].nk == 4
    assert abs(seen.impulse.gain - 2.0) < 4 * seen.impulse.gain_sd
    assert seen.informative.best.identifiable


def test_the_page_loads_nothing_and_its_figures_are_json(look):
    _, page = look
    own = page.replace(library(), "")
    assert not re.search(r"url\(|@import|https?://", own)
    figures = re.findall(r'<script type="application/json"[^>]*>(.*?)</script>', own, re.S)
    assert len(figures) == 6 and all(json.loads(figure)["data"] for figure in figures)


def test_no_name_acts(tmp_path):
    columns = heater(200)
    columns[f"a{EVIL}"] = columns.pop("temp")
    _, page = written(tmp_path, columns, u="power", y=f"a{EVIL}")
    assert EVIL not in page


def test_a_record_that_says_nothing_asks_for_an_experiment(tmp_path):
    columns = heater(300) | {"power": np.full(300, 3.0)}
    seen, page = written(tmp_path, columns, u="power", y="temp")
    assert "X01" in {note.code for note in seen.findings}
    assert "plantune design" in seen.steps[-1] and "not as it is" in page


def test_without_names_the_page_says_how_to_name_them(tmp_path):
    seen, page = written(tmp_path, heater(100))
    assert seen.record is None and "--u COLUMN --y COLUMN" in seen.steps[0]
    assert "heater" in page and "figure-record" not in page
