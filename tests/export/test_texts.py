"""What the texts say of themselves, how they are named, and what cannot be exported."""

import shutil
import subprocess
from dataclasses import replace

import numpy as np
import pytest

import plantune as pt
from contract.records import check_refusal
from export.cases import CONTROLLERS, PLANTS
from export.st import FunctionBlock, tokens
from plantune.models import PID, PolyModel, ProcessModel

PLANT = ProcessModel(K=2.0, T=5.0, L=1.0)
PI = PID(Kp=1.0, Ti=5.0)
WRITERS = pytest.mark.parametrize("write", [pt.export.structured_text, pt.export.c_source])


@pytest.fixture(scope="module")
def tuning():
    fit = pt.estimate.process(pt.datasets.engine_loop(noise_var=1.5), "P1D")
    return pt.tune.imc_pi(fit, gain_margin=3)


@WRITERS
def test_the_head_states_what_a_reader_must_know(write, tuning):
    text = write(tuning, Ts=0.02, u_min=0, u_max=100, u_unit="%", y_unit="1/min")
    head = text.split("*)" if write is pt.export.structured_text else "*/")[0]
    for said in (
        str(tuning.controller),
        tuning.rule,
        str(tuning.model),
        tuning.source,
        "gain 2.6",  # sampled every 0.02 s; 3 in continuous time
        "95 %        gain 2.95 to 3.05",
        "u in %, r and y in 1/min",
        f"plantune {pt.__version__}",
    ):
        assert said in head
    assert text.isascii() and max(map(len, text.splitlines())) <= 100


@WRITERS
@pytest.mark.parametrize(
    "evil", ["*)", "*/", "(*", "/*", "\n*/\n", "??/", "\\", "*\u200b/", "**//"]
)
def test_no_text_from_outside_leaves_its_comment(write, evil, tuning):
    hostile = replace(tuning, rule=f"a {evil} b", source=f"{evil}x := 1;{evil}")
    text = write(hostile, Ts=0.02, u_unit=evil, y_unit=evil)
    clean = write(tuning, Ts=0.02)
    if write is pt.export.structured_text:
        assert [*tokens(text)] == [*tokens(clean)]
    else:
        assert text.count("/*") == text.count("*/") == clean.count("/*")
        assert text.split("#ifndef", 1)[1] == clean.split("#ifndef", 1)[1]
        assert "??" not in text


@pytest.mark.parametrize("name", ["a b", "1a", "", "a__b", "_a", "a_", "x;", "é", "IF", "lreal"])
def test_a_block_has_a_name_that_is_one(name):
    with pytest.raises(pt.UsageError) as caught:
        pt.export.structured_text(PI, Ts=0.1, name=name)
    check_refusal(caught.value, "U01", ())
    assert "FUNCTION_BLOCK Loop_7\n" in pt.export.structured_text(PI, Ts=0.1, name="Loop_7")


@WRITERS
@pytest.mark.parametrize(
    ("what", "options", "code"),
    [
        (PI, {}, "U01"),
        (PI, {"Ts": 0.0}, "U01"),
        (PI, {"Ts": np.nan}, "U01"),
        (PID(Kp=1.0, Ti=5.0, Ts=0.1), {"Ts": 0.2}, "U01"),
        (PID(Kp=1.0, Ti=5.0, b=np.nan), {"Ts": 0.2}, "U01"),
        (PI, {"Ts": 0.1, "u_min": 0.0}, "U01"),
        (PI, {"Ts": 0.1, "u_min": 1.0, "u_max": 1.0}, "U01"),
        (PI, {"Ts": 0.1, "u_min": 0.0, "u_max": np.inf}, "U01"),
        (PLANT, {}, "U01"),
        (PLANT, {"Ts": 0.1, "u_min": 0.0, "u_max": 1.0}, "U01"),
        (replace(PLANT, L=1e9), {"Ts": 0.1}, "U01"),
        (replace(PLANT, K=0.0), {"Ts": 0.1}, "M12"),
        (PolyModel(B=[[1.0], [2.0]], Ts=0.1), {}, "U01"),
        (PolyModel(B=[1.0], Ts=0.1), {"Ts": 0.2}, "U01"),
        (pt.estimate.least_squares(np.eye(3), [1.0, 2.0, 3.0]), {}, "U01"),
        ("model.json", {"Ts": 0.1}, "U01"),
    ],
    ids=str,
)
def test_what_cannot_be_exported_is_refused(write, what, options, code):
    with pytest.raises(pt.PlantuneError) as caught:
        write(what, **options)
    check_refusal(caught.value, code, ())


@WRITERS
def test_a_loop_that_sampling_makes_unstable_is_refused(write):
    tuning = pt.tune.simc(PLANT)
    with pytest.raises(pt.RunError) as caught:
        write(tuning, Ts=5.0)
    check_refusal(caught.value, "C07", ())


@WRITERS
def test_doubts_of_the_sampled_loop_stand_in_the_head(write):
    tuning = pt.tune.simc(PLANT)
    assert not tuning.notes
    assert "doubt       C07 weak margins: the gain margin is" in write(tuning, Ts=2.0)


def test_an_estimator_has_no_sample_time():
    with pytest.raises(pt.UsageError) as caught:
        pt.export.c_source(pt.recursive.RLS(2), Ts=0.1)
    check_refusal(caught.value, "U01", ())


def test_several_sources_link_into_one_program(tmp_path):
    """Each is compiled once, and included for its declarations where it is called."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler as cc")
    pid = PID(Kp=1.0, Ti=4.0, Ts=0.5)
    (tmp_path / "pid.c").write_text(pt.export.c_source(pid))
    (tmp_path / "plant.c").write_text(pt.export.c_source(PLANT, Ts=0.5))
    (tmp_path / "main.c").write_text("""
        #include <stdio.h>
        #define PID_DECLARATIONS
        #include "pid.c"
        #define PLANT_DECLARATIONS
        #include "plant.c"
        int main(void)
        {
            pid_state c; plant_state p; double y = 0.0;
            pid_init(&c, 0.0, 0.0); plant_init(&p);
            for (int k = 0; k < 200; k++)
                y = plant_step(&p, pid_step(&c, 1.0, y));
            printf("%.17g\\n", y);
            return 0;
        }""")
    strict = ["-std=c99", "-Wall", "-Wextra", "-pedantic", "-Werror"]
    files = ["main.c", "pid.c", "plant.c", "-o", "loop"]
    subprocess.run([compiler, *strict, *files], cwd=tmp_path, check=True)
    y = float(subprocess.run([tmp_path / "loop"], capture_output=True, check=True).stdout)
    assert y == pytest.approx(pt.simulate.closed_loop(PLANT, pid, [1.0] * 200).y[-1], rel=1e-12)


@pytest.mark.parametrize("case", [*CONTROLLERS, *PLANTS])
def test_an_independent_grammar_of_the_standard_reads_it(case):
    """A tree-sitter grammar of the third edition; it has no wheels, so it may be absent."""
    tree_sitter = pytest.importorskip("tree_sitter")
    grammar = pytest.importorskip("tree_sitter_iec61131_3_st")
    if case in CONTROLLERS:
        text = pt.export.structured_text(CONTROLLERS[case], u_min=-1.0, u_max=1e5)
    else:
        text = pt.export.structured_text(*PLANTS[case])
    parser = tree_sitter.Parser(tree_sitter.Language(grammar.language()))
    assert not parser.parse(text.encode()).root_node.has_error


def test_blocks_keep_apart_what_the_language_does_not():
    """Names differ in more than small and capital letters; `FunctionBlock` refuses others."""
    for pid in CONTROLLERS.values():
        FunctionBlock(pt.export.structured_text(pid, u_min=0.0, u_max=1.0))
