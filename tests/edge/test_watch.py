"""`plantune watch`: the demo, a record, the log that is a record again, the view, refusals."""

import io

import numpy as np
import pytest
from rich.console import Console

import plantune as pt
from contract.records import plantune, strict_json
from plantune.cli.watch import _paced
from plantune.cli.watch_view import View

LOOP = ("--Kp", "-0.018", "--Ti", "0.0531758", "--nk", "3:9")


@pytest.fixture(scope="module")
def demo(tmp_path_factory):
    """Run the demo once: what it printed, and its log."""
    log = tmp_path_factory.mktemp("watch") / "log.csv"
    return plantune("watch", "demo", "--json", "--out", log), log


@pytest.fixture
def table(tmp_path):
    """Write the engine loop as a table."""
    rec = pt.datasets.engine_loop(noise_var=1.0, t_end=12.0, seed=1)
    rows = np.column_stack([rec.time, rec.u[:, 0], rec.y[:, 0], rec.r[:, 0]])
    path = tmp_path / "engine.csv"
    np.savetxt(path, rows, delimiter=",", header="t,act,out,set", comments="", fmt="%.17g")
    return path


def columns(path):
    """Return the options that name the columns of the table."""
    return (path, "--u", "act", "--y", "out", "--r", "set", "--Ts", 0.02)


def test_the_demo_is_tuned_and_tuned_again_when_its_plant_changes(demo):
    done, _ = demo
    assert done.exit_code == 0, done.output
    fields = strict_json(done.stdout)
    assert fields["model"]["K"] == pytest.approx(-1.5 * 5.939, rel=0.02)
    assert any(20.0 <= t <= 20.5 for t in fields["alarms"])
    assert fields["retunings"][-1]["t"] > 20.0
    # IMC-PI with a gain margin of 3: Kp = T / (K (T_F + L)), source 001, 3.6.6.
    assert fields["controller"]["Kp"] == pytest.approx(-0.1315 / 1.5, rel=0.05)
    assert all(code[0] in "ACDMX" for code in fields["reasons"])


def test_its_log_reads_back_as_a_record(demo):
    done, path = demo
    fields = strict_json(done.stdout)
    columns = {"u": "u", "y": "y", "r": "r", "time": "t", "Ts": 0.02}
    rec = pt.read(path, **columns, aux=["Kp", "retuned"])
    assert rec.N == fields["samples"]
    assert rec.aux["Kp"][-1] == fields["controller"]["Kp"]
    assert rec.aux["retuned"].sum() == len(fields["retunings"])


def test_what_its_log_does_not_know_is_an_empty_cell(demo):
    done, path = demo
    lines = path.read_text(encoding="utf-8").splitlines()
    cells = dict(zip(lines[0].split(","), lines[1].split(","), strict=True))
    assert [cells[name] for name in ("K", "T", "L", "offset")] == [""] * 4
    assert cells["retuned"] == "0" and float(cells["Kp"]) == -0.018
    columns = {"u": "u", "y": "y", "r": "r", "time": "t", "Ts": 0.02, "aux": ["K", "T"]}
    with pytest.raises(pt.DataError, match="`K` is missing") as refused:
        pt.read(path, **columns)
    assert refused.value.code == "D07"
    rec = pt.read(path, **columns, missing="segments")
    assert 1900 < rec.N < strict_json(done.stdout)["samples"] and not (rec.aux["K"] == 0).any()


def test_a_record_is_watched_and_stays_as_it_was(table):
    done = plantune("watch", *columns(table), *LOOP, "--json")
    assert done.exit_code == 0, done.output
    fields = strict_json(done.stdout)
    rec = pt.read(table, u="act", y="out", r="set", Ts=0.02)
    pid = pt.models.PID(Kp=-0.018, Ti=0.0531758)
    log = pt.adapt.replay(rec, pt.adapt.Settings(Ts=0.02, nk=(3, 9), controller=pid))
    assert fields["accepted"] == log.accepted.sum() > 0
    assert fields["controller"]["Kp"] == log.Kp[-1]


def test_every_estimate_can_be_had_as_a_line(table):
    done = plantune("watch", *columns(table), *LOOP, "--json", "--decisions")
    lines = [strict_json(line) for line in done.stdout.splitlines()]
    assert len(lines) >= 50
    assert {"t", "K", "T", "L", "sd", "delay_posterior", "reasons"} <= set(lines[0])
    assert sum(lines[-1]["delay_posterior"].values()) == pytest.approx(1.0)


def test_a_pipe_gets_a_line_per_event_and_a_summary(table):
    done = plantune("watch", *columns(table), *LOOP)
    assert "\x1b" not in done.stdout
    assert "first estimate accepted" in done.stdout and "retuned" in done.stdout
    assert "AdaptLog: 600 samples" in done.stdout


def test_the_figure_is_written(table, tmp_path):
    done = plantune("watch", *columns(table), *LOOP, "--json", "--figure", tmp_path / "f.html")
    assert done.exit_code == 0
    page = (tmp_path / "f.html").read_text(encoding="utf-8")
    assert "Auto-tuner:" in page and '"text":"out"' in page and "[?]" not in page


def test_the_view_shows_parameters_delays_settings_and_reasons():
    rec = pt.datasets.engine_loop(noise_var=1.5, t_end=3.0, seed=1)
    pid = pt.models.PID(Kp=-0.018, Ti=0.0531758)
    settings = pt.adapt.Settings(Ts=0.02, nk=(3, 9), controller=pid)
    view, text = View("Engine", settings), io.StringIO()
    console = Console(file=text, force_terminal=True, width=100, color_system=None)
    console.print(view.render())
    for step in pt.edge.run(pt.edge.RecordedPlant(rec, shadow=True), pt.adapt.AutoTuner(settings)):
        view.take(*step)
    console.print(view.render())
    shown = text.getvalue()
    assert "waiting for the first sample" in shown
    for part in ("K", "T, s", "L, s", "offset", "█", "at work: PI", "K and T known to 1 %"):
        assert part in shown


@pytest.mark.parametrize(
    "arguments",
    [
        ("demo", "--nk", "five"),
        ("demo", "--nk", "9:3"),
        ("demo", "--limit", "C07=x"),
        ("nowhere.csv", "--u", "a", "--y", "b", "--Ts", 1, "--Kp", 1),
    ],
)
def test_what_cannot_be_watched_is_refused(arguments):
    done = plantune("watch", *arguments, "--json")
    assert (done.exit_code, strict_json(done.stdout)["error"]["code"]) == (2, "U01")


@pytest.mark.parametrize("option", ["--out", "--figure"])
def test_what_cannot_be_written_is_refused_by_its_name(table, tmp_path, option):
    done = plantune("watch", *columns(table), *LOOP, "--json", option, tmp_path / "no" / "where")
    error = strict_json(done.stdout)["error"]
    assert (done.exit_code, error["code"]) == (5, "R08")
    assert error["remedy"] == f"choose another {option}"


def test_a_pace_waits_for_the_plant(monkeypatch):
    class Clock:
        now = 100.0

        def monotonic(self):
            return self.now

        def sleep(self, seconds):
            self.now += seconds

    clock = Clock()
    monkeypatch.setattr("plantune.cli.watch.time", clock)
    steps = [(pt.adapt.Sample(t), None) for t in (5.0, 6.0, 9.0)]
    assert [clock.now for _ in _paced(iter(steps), 2.0)] == [100.0, 100.5, 102.0]


def test_a_record_needs_the_gain_at_work(table):
    done = plantune("watch", *columns(table), "--json")
    assert (done.exit_code, strict_json(done.stdout)["error"]["code"]) == (2, "U01")
