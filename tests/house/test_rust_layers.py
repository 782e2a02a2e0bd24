"""The core's rooms import down only, and the core stays pure: no files, clock, threads, Python."""

import re
from pathlib import Path

import pytest

CRATES = Path(__file__).resolve().parents[2] / "crates"
CORE = CRATES / "plantune-core" / "src"

# Lowest first; rooms on one line may use each other.  DESIGN 2, and what `batch` needs below it:
# `stats` (quantiles), `excitation` (how much an input moves) and `relation` (whether y follows u).
LAYERS = [
    "error note limits",
    "linalg poly stats",
    "record signal regress excitation relation",
    "model",
    "sim",
    "batch recursive hysteresis",
    "analyze",
    "validate",
    "tune",
    "adapt",
]
LEVEL = {room: level for level, line in enumerate(LAYERS) for room in line.split()}


def code(path):
    """Return a source file without its comments."""
    return re.sub(r"//.*", "", path.read_text(encoding="utf-8"))


def first_names(text, root):
    """List what follows `root::`, through one pair of braces: `use root::{a::b, c}` gives a, c."""
    names = []
    for found in re.finditer(rf"\b{root}::", text):
        rest = text[found.end() :]
        if not rest.startswith("{"):
            names.append(re.match(r"\w*", rest)[0])
            continue
        depth, item = 0, ""
        for char in rest:
            depth += (char == "{") - (char == "}")
            if depth == 0 or (depth == 1 and char == ","):
                names.append(re.match(r"\w*", item.strip())[0])
                item = ""
            elif not (depth == 1 and char == "{"):
                item += char
            if depth == 0:
                break
    return [name for name in names if name]


def core_files():
    """List (room, path) of the core's sources but lib.rs, which names every room."""
    for path in sorted(CORE.rglob("*.rs")):
        room = path.relative_to(CORE).with_suffix("").parts[0]
        if room != "lib":
            yield room, path


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("use crate::model::Poly;", ["model"]),
        ("use crate::{model::{Poly, Pid},\n    sim};", ["model", "sim"]),
        ("let p = crate::poly::roots(a);", ["poly"]),
        ("use crate::{\n    error::Error,\n    linalg::qr,\n};", ["error", "linalg"]),
    ],
)
def test_reader_of_paths(text, names):
    assert first_names(text, "crate") == names


def test_every_room_has_a_layer():
    assert {room for room, _ in core_files()} <= set(LEVEL)


def test_rooms_use_lower_rooms_only():
    upward = [
        f"{path.relative_to(CORE)} uses crate::{name}"
        for room, path in core_files()
        for name in first_names(code(path), "crate")
        # An item that lib.rs re-exports has no level: the room must be named.
        if LEVEL.get(name, len(LAYERS)) > LEVEL.get(room, 0)
    ]
    assert not upward, "name a lower room: " + "; ".join(upward)


def test_core_is_pure():
    stains = []
    for path in sorted(CORE.rglob("*.rs")):
        text = code(path)
        banned = {"fs", "io", "net", "process", "thread", "time"} & set(first_names(text, "std"))
        stains += [f"{path.relative_to(CORE)}: std::{name}" for name in sorted(banned)]
        stains += [
            f"{path.relative_to(CORE)}: {macro}"
            for macro in re.findall(r"\b(?:e?print(?:ln)?|dbg)!", text)
        ]
    assert not stains, "; ".join(stains)


def test_python_is_known_to_the_glue_only():
    named = [
        str(path.relative_to(CRATES))
        for path in [*CRATES.rglob("*.rs"), *CRATES.glob("*/Cargo.toml")]
        if re.search(r"\bpyo3\b", code(path)) and "plantune-py" not in path.parts
    ]
    assert not named
