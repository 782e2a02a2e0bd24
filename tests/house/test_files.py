"""Rules for every file of the repository."""

import ast
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DATA = {".csv", ".dat", ".h5", ".mat", ".npy", ".npz", ".parquet", ".xls", ".xlsx", ".zip"}
# A folder of one machine; the letter before it would make it part of a longer path.
MACHINE_PATH = re.compile(r"(?<![\w.~/-])/(home|Users|root|work|mnt)/\w|\b[A-Z]:\\Users")


@pytest.fixture(scope="module")
def files():
    """List what git keeps or would keep."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    try:
        listed = subprocess.run(command, cwd=ROOT, capture_output=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("not a git clone")
    paths = [ROOT / name for name in listed.stdout.decode().split("\0") if name]
    return [path for path in paths if path.is_file()]


def relative(paths):
    """Name paths as the repository does."""
    return [str(path.relative_to(ROOT)) for path in paths]


def test_no_path_of_one_machine(files):
    found = []
    for path in files:
        text = path.read_bytes().decode("utf-8", errors="ignore")
        found += [f"{path.relative_to(ROOT)}: {m[0]}" for m in MACHINE_PATH.finditer(text)]
    assert not found, "; ".join(found)


def test_data_live_in_datasets_only(files):
    shipped = ROOT / "python" / "plantune" / "datasets"
    stray = [p for p in files if p.suffix in DATA and shipped not in p.parents]
    assert not stray, relative(stray)


def test_every_python_file_says_what_it_is(files):
    silent = [
        path
        for path in files
        if path.suffix == ".py" and not ast.get_docstring(ast.parse(path.read_bytes()))
    ]
    assert not silent, relative(silent)


def test_package_modules_do_not_import_the_whole_package(files):
    """It would hide from the import rules which stage is meant."""
    package = ROOT / "python" / "plantune"
    whole = []
    for path in files:
        if path.suffix == ".py" and package in path.parents:
            for node in ast.walk(ast.parse(path.read_bytes())):
                names = [a.name for a in node.names] if isinstance(node, ast.Import) else []
                whole += [path] * ("plantune" in names)
    assert not whole, relative(whole)


def test_unsafe_in_one_file_at_most(files):
    """The one that may have it dispatches SIMD kernels."""
    unsafe = [
        path
        for path in files
        if path.suffix == ".rs"
        and re.search(r"\bunsafe\b", re.sub(r"//.*", "", path.read_text(encoding="utf-8")))
    ]
    assert len(unsafe) <= 1, relative(unsafe)
    assert 'unsafe_code = "deny"' in (ROOT / "Cargo.toml").read_text(encoding="utf-8")
