"""The report is one file, loads nothing, says everything and lets no name act."""

import json
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

import plantune as pt
from plantune import report
from plantune.notes import Note, Where
from plantune.plot.embed import library

EVIL = "</script><script>alert(1)</script><img src=x onerror=alert(2)>\"'&"
LOADING = {"src", "href", "action", "data", "poster", "srcset", "formaction", "background"}


class Page(HTMLParser):
    """Tags, attributes that load, texts of scripts, and the visible text."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.loads, self.scripts, self.ids, self.words = [], [], [], [], []
        self.open = []
        self.feed(text)
        self.text = " ".join(" ".join(self.words).replace("\xa0", " ").split())

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.open.append(tag)
        self.loads += [(tag, value) for name, value in attrs if name in LOADING]
        self.ids += [value for name, value in attrs if name == "id"]
        if tag == "script":
            self.scripts.append([dict(attrs), ""])

    def handle_endtag(self, tag):
        while self.open and self.open.pop() != tag:
            pass

    def handle_data(self, data):
        if self.open and self.open[-1] == "script":
            self.scripts[-1][1] += data
        elif not self.open or self.open[-1] != "style":
            self.words.append(data)

    @property
    def figures(self):
        return {a["data-figure"]: json.loads(t) for a, t in self.scripts if "data-figure" in a}


@pytest.fixture(scope="module")
def page(make, tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "report.html"
    truth = {"K": -2.0, "T": 1.5, "L": 0.43, "offset": 7.0}
    note = Note("M08", "warning", "not white", Where("level", 3, 0.3), 4, 0.5, 0.1, "be careful")
    run = make(truth=truth, notes=[note, note], units={"valve": "%", "level": "cm"})
    assert report.write(path, run) == path
    return Page(path.read_text(encoding="utf-8"))


def read(path, run):
    return Page(report.write(path, run).read_text(encoding="utf-8"))


def test_nothing_is_loaded_from_outside(page):
    assert all(value == "data:," or value.startswith("#") for _, value in page.loads)
    assert not {"iframe", "object", "embed", "base", "form"} & set(page.tags)


def test_the_browser_is_told_to_load_nothing(make, tmp_path):
    text = report.write(tmp_path / "a.html", make()).read_text(encoding="utf-8")
    policy = re.search(r'Content-Security-Policy" content="([^"]+)"', text)[1]
    assert policy.startswith("default-src 'none'") and "http" not in policy
    assert "showSendToCloud: false" in text
    own = text.replace(library(), "")
    assert not re.search(r"url\(|@import|https?://", own)


def test_the_drawing_library_is_there_once(make, tmp_path):
    text = report.write(tmp_path / "a.html", make()).read_text(encoding="utf-8")
    assert text.count(library()[:300]) == 1
    assert len(text) - len(library()) < 700_000


def test_sections_and_figures_are_there_in_order(page):
    wanted = ["notes", "settings", "rules", "model", "figures", "figure-record", "figure-fit",
              "figure-residuals-0", "figure-residuals-1", "figure-step", "figure-bode",
              "figure-margins", "figure-robustness", "figure-loop", "figure-rules",
              "figure-delay", "indices", "provenance"]  # fmt: skip
    assert [name for name in page.ids if name in wanted] == wanted
    assert len(page.ids) == len(set(page.ids))


def test_every_figure_has_its_place_caption_and_alternative_text(page):
    assert len(page.figures) == 11
    assert set(page.figures) <= set(page.ids)
    assert page.tags.count("figcaption") == 11


def test_the_page_says_which_fit_is_which(page, make):
    verdict = make().verdicts["P1D"]
    assert f"its simulation fit is {verdict.fit:.1f} %" in page.text
    assert f"fit of the simulation [%] {make().verdicts['ARX'].fit:.1f}" in page.text
    assert "fit one step ahead [%]" in page.text


def test_settings_margins_and_truth_are_printed(page, make):
    run = make()
    low, high = run.tunings[0].bands["gain"]
    assert f"{run.tunings[0].controller.Kp:.5g}" in page.text
    assert f"3.00 ({low:.2f} to {high:.2f})" in page.text
    assert "true value" in page.text and "0.43" in page.text


def test_a_note_shows_code_evidence_and_remedy_once(page):
    assert page.text.count("not white") == 1
    assert "run; at level, row 3, 0.3 s; count 4; measured 0.5, limit 0.1" in page.text
    assert "be careful" in page.text


def test_provenance_names_record_rows_steps_and_versions(page, make):
    for text in (make(units={"valve": "%", "level": "cm"}).record.source, "600 rows read",
                 f"plantune {pt.__version__}", "0 to 299"):  # fmt: skip
        assert text in page.text, text


def test_without_truth_units_or_notes(make, tmp_path):
    page = read(tmp_path / "a.html", make())
    assert "true value" not in page.text
    assert "valve: not given" in page.text
    assert "Nothing in the data leaves a doubt" in page.text


def test_notes_of_every_part_are_shown_with_where_they_come_from(make, tmp_path):
    run = make(fresh=False)
    page = read(tmp_path / "a.html", run)
    assert page.text.count("rows were used to fit") == 1
    assert "ARX judged, P1D judged; count 600" in page.text


def test_without_fresh_rows_nothing_is_called_fresh(make, tmp_path):
    page = read(tmp_path / "a.html", make(fresh=False))
    assert "on the rows it was fitted on, not validated" in page.text
    assert "fresh" not in page.text
    assert not any("fresh" in str(figure) for figure in page.figures.values())


def test_with_a_reference_gaps_and_outputs_that_do_not_count(make, tmp_path):
    valid = np.ones(600, bool)
    valid[40:60] = False
    run = make(r=np.full(600, 7.0), starts=[0, 200], valid=valid)
    page = read(tmp_path / "a.html", run)
    names = [trace.get("name") for trace in page.figures["plot-record"]["data"]]
    assert "set point of level" in names
    assert "outputs that do not count 20" in page.text


def test_without_settings_the_page_says_so(make, tmp_path):
    run = replace(make(), tunings=(), responses=(), comparison=None)
    page = read(tmp_path / "a.html", run)
    assert "No settings are given" in page.text
    assert not {"indices", "rules"} & set(page.ids)
    assert ("a", "#indices") not in page.loads


def test_no_name_acts(make, tmp_path):
    note = Note("X00", "warning", EVIL, Where(EVIL, 1, 0.1), remedy=EVIL)
    names = {"u_names": [EVIL], "y_names": [EVIL + "y"], "units": {EVIL: EVIL}, "log": (EVIL,)}
    plain = read(tmp_path / "plain.html", make())
    hostile = read(tmp_path / "evil.html", make(title=EVIL, notes=[note], **names))
    assert hostile.tags.count("script") == plain.tags.count("script")
    assert "img" not in hostile.tags
    assert "<script>alert(1)</script>" in hostile.text  # shown as text
    for figure in hostile.figures.values():
        assert not re.search(r"<(?!br>)", json.dumps(figure))  # the one tag is ours


def test_the_main_job_ends_in_a_report(tmp_path):
    truth = {"K": -5.939, "T": 0.1491, "L": 0.1, "offset": 583.451}
    run = pt.job.run(pt.datasets.engine_loop(noise_var=1.5), title="Engine loop", truth=truth)
    page = read(tmp_path / "engine.html", run)
    assert "Engine loop" in page.text and "583.451" in page.text
    assert "figure-margins" in page.ids


def test_it_is_written_whole_or_not_at_all(make, tmp_path):
    path = tmp_path / "report.html"
    path.write_text("the old one")
    broken = replace(make(), chosen=None)
    with pytest.raises(AttributeError):
        report.write(path, broken)
    assert path.read_text() == "the old one"
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]
    report.write(str(path), make())
    assert path.read_text(encoding="utf-8").startswith("<!doctype html>")
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]


def test_the_same_run_gives_the_same_page(make, tmp_path):
    run = make()
    one, two = (report.write(tmp_path / name, run) for name in ("a.html", "b.html"))
    assert one.read_bytes() == two.read_bytes()
