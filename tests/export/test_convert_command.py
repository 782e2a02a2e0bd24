"""`plantune convert`: the same numbers as from Python, as text and as one JSON object."""

import json

import pytest
from pytest import approx
from typer.testing import CliRunner

import plantune as pt
from plantune.cli import main as cli  # noqa: F401 - loads every command
from plantune.cli.main import app
from plantune.models import PID

SERIES = ("--Kp", 2, "--Ti", 10, "--Td", 2, "--from", "series")
SPANS = ("--pv-span", 100, "--op-span", 100)


def run(*arguments):
    return CliRunner().invoke(app, ["convert", *map(str, arguments)])


def of_json(*arguments):
    return json.loads(run(*arguments, "--json").stdout)


def test_the_printed_vector():
    pid = PID.from_form("series", Kp=2.0, Ti=10.0, Td=2.0)
    for form in ("ideal", "parallel", "series", "pb"):
        done = run(*SERIES, "--to", form)
        assert (done.exit_code, done.stdout) == (0, f"{pid.to(form)}\n")
        fields = of_json(*SERIES, "--to", form)
        assert fields["form"] == form
        assert {letter: fields[letter] for letter in pid.to(form).letters} == pid.to(form).settings
    assert of_json(*SERIES, "--to", "pb")["repeats_per_minute"] == approx(5.0)
    parallel = of_json(
        "--from",
        "pb",
        "--PB",
        125 / 3,
        "--Ti",
        0.2,
        "--Td",
        5 / 180,
        "--to",
        "parallel",
        "--time-unit",
        "min",
    )
    assert (parallel["Kp"], parallel["Ki"], parallel["Kd"]) == approx((2.4, 12.0, 4 / 60))


def test_controllers_and_spans():
    pid = PID.from_form("series", Kp=2.0, Ti=10.0, Td=2.0)
    done = run(*SERIES, "--to", "deltav-series", *SPANS)
    entry = pt.export.vendor(pid, "deltav-series", pv_span=100.0, op_span=100.0)
    assert (done.exit_code, done.stdout) == (0, f"{entry}\n")
    fields = of_json(
        *SERIES, "--to", "rockwell-pide", "--pv-span", 200, "--op-span", 100, "--digits", 3
    )
    assert fields["values"] == {"PGain": 4.8, "IGain": 24.0, "DGain": 0.133}
    assert fields["level"] == "verified" and fields["controller"]["kind"] == "pid"
    assert of_json("--Kp", -2, "--Ti", 5, "--to", "ideal", *SPANS)["pv_span"] == 100.0


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (("--Kp", 2, "--Ti", 10, "--to", "acme"), "acme"),
        (("--Ti", 10, "--to", "pb"), "needs Kp"),
        (("--Kp", 2, "--Ki", 10, "--to", "pb"), "has no Ki"),
        (("--Kp", 2, "--Ti", 10, "--to", "rockwell-pide"), "`pv_span`"),
        (("--Kp", 2, "--Ti", 10, "--to", "velocity"), "`Ts`"),
        (("--Kp", 2, "--from", "isa", "--to", "pb"), "isa"),
        (("--Kp", "x", "--to", "pb"), "--Kp"),
        (
            (
                "--Kp",
                2,
            ),
            "--to",
        ),
    ],
)
def test_refusals(arguments, word):
    done = run(*arguments)
    assert done.exit_code == 2 and not done.stdout
    assert done.stderr.startswith("U01: ") and word in done.stderr.splitlines()[0]
    error = of_json(*arguments)["error"]
    assert error["code"] == "U01" and error["remedy"]


def test_a_refused_form_brings_the_nearest():
    arguments = ("--Kp", 2, "--Ti", 10, "--Td", 5, "--to", "series")
    done = run(*arguments)
    assert done.exit_code == 2 and "Ti >= 4 Td; nearest Kp = 1.172" in done.stderr
    fields = of_json(*arguments)
    assert fields["error"]["code"] == "U01"
    assert fields["nearest"]["deviation"] == approx(0.1716, abs=1e-4)
    assert fields["nearest"]["Ti"] == fields["nearest"]["Td"] == approx(50**0.5)
