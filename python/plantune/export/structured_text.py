"""Function blocks in structured text, IEC 61131-3.

The text keeps to what every controller of the standard takes: LREAL, INT and BOOL, one ARRAY, IF;
no vendor's functions, no implicit conversion, no name of an instruction list operator.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from math import isfinite

from plantune.errors import refusal
from plantune.estimate import Fit
from plantune.export.subject import Controller, Plant, comment, named, subject_of
from plantune.models import PID, PolyModel, ProcessModel, TransferFunction
from plantune.tune import Tuning

_KEYWORDS = frozenset(
    word
    for line in (
        "AND ARRAY AT BOOL BY BYTE CASE CONSTANT DINT DO ELSE ELSIF EXIT FALSE FOR FUNCTION IF",
        "INT LREAL MOD NOT OF OR PROGRAM REAL REPEAT RETAIN RETURN STRING STRUCT THEN TIME TO TRUE",
        "TYPE UNTIL VAR WHILE WORD XOR",
    )
    for word in line.split()
)


def structured_text(
    what: Tuning | PID | Fit | ProcessModel | TransferFunction | PolyModel,
    Ts: float | None = None,
    *,
    u_min: float | None = None,
    u_max: float | None = None,
    name: str | None = None,
    u_unit: str = "",
    y_unit: str = "",
) -> str:
    r"""Return a function block in structured text: a PID controller, or a plant simulator.

    Call the block once every `Ts` seconds.  A controller does exactly what `simulate.closed_loop`
    simulates with a sampled one.  Its first call is in manual, so the loop takes over from
    `u_man`; back from manual it goes on without a bump.  At a limit its integral waits while the
    error would drive it further out.  After a call of a plant with `u`, `y` is what is measured at
    the next sample (at the same one where the model has no delay, `nk = 0`); it starts at rest.

    Parameters
    ----------
    what : Tuning, PID, Fit, ProcessModel, TransferFunction or PolyModel
        A controller, or a plant of one input.
    Ts : float, optional
        Sample time, seconds; needed where `what` has none of its own.
    u_min, u_max : float, optional
        Both or neither: range of the controller's output, in its units.
    name : str, optional
        Of the block; `PT_PID` or `PT_PLANT` by default.
    u_unit, y_unit : str
        Units, for the comments.

    Returns
    -------
    str
        ASCII.  Its head states settings, units, plant, margins at this sample time, doubts and the
        fingerprint of the record.

    Raises
    ------
    UsageError
        Without a sample time or with another one than the model's, a range that is none, a
        name that is none, more than one input (U01).
    RunError
        A tuning whose loop is unstable at this sample time (C07).

    Notes
    -----
    The law of the integral is clamping, also called conditional integration.  Source 001, (3.4-1)
    and (3.5-46), for the plant, its fraction of a sample exact.

    Examples
    --------
    >>> import plantune as pt
    >>> tuning = pt.tune.simc(pt.models.ProcessModel(K=2.0, T=5.0, L=1.0))
    >>> text = structured_text(tuning, Ts=0.1, u_min=0.0, u_max=100.0)
    >>> print(text[text.index("P_term :=") : text.index("started :=")])
    P_term := Kp * (b * sp - pv);
    IF man OR NOT started THEN
        u := u_man;
        I_term := u - P_term;                       (* the next call goes on from here *)
    ELSE
        I_next := I_term + Ki * Ts * e;
        u := P_term + I_next;
        IF ((u > u_max) AND (Ki * e > 0.0)) OR ((u < u_min) AND (Ki * e < 0.0)) THEN
            u := P_term + I_term;                   (* the integral waits *)
        ELSE
            I_term := I_next;
        END_IF;
        IF u > u_max THEN
            u := u_max;
        ELSIF u < u_min THEN
            u := u_min;
        END_IF;
    END_IF;
    """
    subject = subject_of(what, Ts, u_min, u_max, (u_unit, y_unit))
    if isinstance(subject, Controller):
        lines = _controller(subject, named(name, "PT_PID", _KEYWORDS))
    else:
        lines = _plant(subject, named(name, "PT_PLANT", _KEYWORDS))
    return "\n".join(lines) + "\n"


def _controller(c: Controller, name: str) -> list[str]:
    """`u = P + I + D`, in manual and in automatic."""
    derivative = c.pid.Td > 0
    D = " + D_term" if derivative else ""
    states = {"started": "BOOL := FALSE", "e": "LREAL", "P_term": "LREAL", "I_term": "LREAL := 0.0"}
    states |= {"I_next": "LREAL"}
    if derivative:
        states |= {"D_term": "LREAL", "w": "LREAL", "x": "LREAL := 0.0"}
    law = ["e := sp - pv;", "P_term := Kp * (b * sp - pv);"]
    if derivative:
        law += [
            "w := c * sp - pv;",
            "IF NOT started THEN",
            _aligned("    x := w;", "the derivative starts at rest"),
            "END_IF;",
            "D_term := Kp * Td / (Tf + Ts) * (w - x);",
            "x := x + Ts / (Tf + Ts) * (w - x);",
        ]
    law += [
        "IF man OR NOT started THEN",
        "    u := u_man;",
        _aligned(
            f"    I_term := u - P_term{D.replace('+', '-')};", "the next call goes on from here"
        ),
        "ELSE",
        "    I_next := I_term + Ki * Ts * e;",
        f"    u := P_term + I_next{D};",
        *(_limited(D) if c.u_min is not None else ["    I_term := I_next;"]),
        "END_IF;",
        "started := TRUE;",
    ]
    inputs = {
        "sp": ("LREAL", "set point r"),
        "pv": ("LREAL", "process value y; take manual while it is bad"),
        "man": ("BOOL := FALSE", "TRUE is manual"),
        "u_man": ("LREAL := 0.0", "output in manual and at the first call"),
    }
    return [
        *_comment(c.about),
        f"FUNCTION_BLOCK {name}",
        *_section("VAR_INPUT", inputs),
        *_section("VAR_OUTPUT", {"u": ("LREAL", "to the actuator")}),
        *_section(
            "VAR CONSTANT", {k: (f"LREAL := {_real(v)}", "") for k, v in c.constants.items()}
        ),
        *_section("VAR", {k: (kind, "") for k, kind in states.items()}),
        "",
        *law,
        "END_FUNCTION_BLOCK",
    ]


def _limited(D: str) -> list[str]:
    """Keep `u` in its range, the integral waiting while it is driven further out."""
    return [
        "    IF ((u > u_max) AND (Ki * e > 0.0)) OR ((u < u_min) AND (Ki * e < 0.0)) THEN",
        _aligned(f"        u := P_term + I_term{D};", "the integral waits"),
        "    ELSE",
        "        I_term := I_next;",
        "    END_IF;",
        "    IF u > u_max THEN",
        "        u := u_max;",
        "    ELSIF u < u_min THEN",
        "        u := u_min;",
        "    END_IF;",
    ]


def _plant(plant: Plant, name: str) -> list[str]:
    """`x` behind `B`, `F` and `A`, then `y = x + offset`."""
    A, F = plant.model.A.tolist()[1:], plant.model.F.tolist()[1:]
    kept = plant.kept
    states = {"x": ("LREAL := 0.0", "output without offset")}
    states |= {f"x_{i}": ("LREAL := 0.0", "") for i in range(1, len(A) + 1)}
    states |= {f"w_{i}": ("LREAL := 0.0", "") for i in range(1, len(F) + 1)}
    states |= {"w": ("LREAL := 0.0", "")}
    if kept > 1:
        states |= {
            "u_past": (f"ARRAY[0..{kept - 1}] OF LREAL", "a ring, the newest at k"),
            "k": ("INT := 0", ""),
        }
    law = [f"k := (k + 1) MOD {kept};", "u_past[k] := u;"] if kept > 1 else []
    (b, lag), *more = plant.terms
    law += [f"w := {_real(b)} * {_input(lag, kept)};"]
    law += [f"w := w{_plus(b)} * {_input(lag, kept)};" for b, lag in more]
    law += _divided("w", F)
    law += ["x := w;", *_divided("x", A)]
    law += [f"y := x{_plus(plant.offset)};" if plant.offset else "y := x;"]
    y = f"y measured at {'the next' if plant.ahead else 'this'} sample"
    return [
        *_comment(plant.about),
        f"FUNCTION_BLOCK {name}",
        *_section("VAR_INPUT", {"u": ("LREAL", "held until the next call")}),
        *_section("VAR_OUTPUT", {"y": (f"LREAL := {_real(plant.offset)}", y)}),
        *_section("VAR", states),
        "",
        *law,
        "END_FUNCTION_BLOCK",
    ]


def _input(lag: int, kept: int) -> str:
    """Return the input of so many calls ago, in the ring of those kept."""
    if kept == 1:
        return "u"
    return "u_past[k]" if lag == 0 else f"u_past[(k + {kept - lag}) MOD {kept}]"


def _divided(x: str, coefficients: list[float]) -> list[str]:
    """`x <- x - sum c_i x(t - i)`, then the past moves on."""
    n = len(coefficients)
    return [
        *(f"{x} := {x}{_plus(-c)} * {x}_{i};" for i, c in enumerate(coefficients, 1)),
        *(f"{x}_{i} := {x}_{i - 1};" for i in range(n, 1, -1)),
        *([f"{x}_1 := {x};"] if n else []),
    ]


def _section(head: str, variables: Mapping[str, tuple[str, str]]) -> list[str]:
    rows = [_aligned(f"    {name} : {kind};", said) for name, (kind, said) in variables.items()]
    return [head, *rows, "END_VAR"]


def _aligned(code: str, said: str) -> str:
    return f"{code:47} (* {said} *)" if said else code


def _comment(lines: Iterable[str]) -> list[str]:
    return ["(*", *(f"   {line}".rstrip() for line in comment(lines)), "*)"]


def _plus(x: float) -> str:
    return f" - {_real(-x)}" if x < 0 else f" + {_real(x)}"


def _real(x: float) -> str:
    """Return an LREAL literal, all its digits.

    Examples
    --------
    >>> _real(-0.1), _real(1e-5), _real(3)
    ('-0.1', '1.0E-05', '3.0')
    """
    if not isfinite(x):
        raise refusal("U01", f"a setting is {x}, must be finite", remedy="pass finite settings")
    mantissa, e, exponent = repr(float(x)).partition("e")
    mantissa = mantissa if "." in mantissa else mantissa + ".0"
    return mantissa + ("E" + exponent if e else "")
