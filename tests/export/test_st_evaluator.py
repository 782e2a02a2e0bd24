"""The evaluator of structured text itself: what it computes, and what it refuses."""

import pytest

from export.st import FunctionBlock, Wrong


def block(body, declared="", kind="LREAL"):
    return FunctionBlock(
        f"FUNCTION_BLOCK f VAR_INPUT a : LREAL; i : INT; END_VAR VAR_OUTPUT out : {kind}; END_VAR "
        f"VAR {declared} END_VAR {body} END_FUNCTION_BLOCK"
    )


@pytest.mark.parametrize(
    ("text", "kind", "value"),
    [
        ("1.0 + 2.0 * 3.0", "LREAL", 7.0),
        ("(1.0 + 2.0) * 3.0", "LREAL", 9.0),
        ("8.0 - 4.0 - 2.0", "LREAL", 2.0),
        ("8.0 / 4.0 / 2.0", "LREAL", 1.0),
        ("-2.0 * 3.0 + 1.0E-01", "LREAL", -5.9),
        ("2.0 * -3.0", "LREAL", -6.0),
        ("7 MOD 3 + 2 * 5", "INT", 11),
        ("-7 MOD 3", "INT", -1),
        ("-7 / 2", "INT", -3),
        ("1.0 < 2.0 AND NOT (3 = 4) OR FALSE", "BOOL", True),
        ("TRUE XOR TRUE OR 1 <> 1", "BOOL", False),
        ("2.0 <= 2.0 AND 3.0 > 2.0", "BOOL", True),
    ],
)
def test_operators_bind_as_the_standard_says(text, kind, value):
    assert block(f"out := {text};", kind=kind)() == pytest.approx(value, rel=1e-15)


def test_state_arrays_branches_and_small_letters():
    summed = block(
        "k := (K + 1) MOD 3; ring[k] := a; (* three *) IF a > 5.0 THEN Out := 5.0; "
        "ELSIF a < 0.0 THEN out := 0.0; ELSE out := ring[0] + ring[1] + ring[2]; END_IF;",
        "k : INT := 0; ring : ARRAY[0..2] OF LREAL;",
    )
    assert [summed(a=x) for x in (1.0, 2.0, 3.0, 4.0, 9.0, -1.0)] == [1.0, 3.0, 6.0, 9.0, 5.0, 0.0]


@pytest.mark.parametrize(
    "body",
    [
        "out := 1;",
        "out := a + i;",
        "out := a MOD 2.0;",
        "out := missing;",
        "a := 1.0;",
        "out := 1.0",
        "IF a THEN out := a; END_IF;",
        "IF a > 1.0 THEN out := a;",
        "out := NOT a;",
        "out := -TRUE;",
        "out := 1.0 AND 2.0;",
        "out = 1.0;",
        "out := a # 2;",
        "FOR i := 1 TO 2 DO out := a; END_FOR;",
        "out := a(1.0);",
    ],
)
def test_what_is_not_of_the_language_is_refused(body):
    with pytest.raises(Wrong):
        block(body)


@pytest.mark.parametrize(
    ("body", "declared"),
    [("out := x[i];", "x : ARRAY[0..2] OF LREAL;"), ("j := i * 20000;", "j : INT;")],
)
def test_what_leaves_its_range_stops(body, declared):
    with pytest.raises(Wrong):
        block(body, declared)(i=3)
