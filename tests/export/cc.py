"""Compile exported C as strictly as it claims to be, and call it."""

import ctypes
import shutil
import subprocess

import pytest

WARNINGS = ["-Wall", "-Wextra", "-pedantic", "-Wconversion", "-Wmissing-prototypes", "-Werror"]


def compiled(folder, text, prefix):
    """Return the functions of a source by their names without prefix; each keeps one state."""
    compiler = shutil.which("cc")
    if compiler is None:
        pytest.skip("no C compiler as cc")
    source, library = folder / f"{prefix}.c", folder / f"{prefix}.so"
    source.write_text(text, encoding="ascii")
    # Nothing of the library, so that it runs where there is none.
    assert "#include" not in text
    command = [compiler, "-std=c99", *WARNINGS, "-O2", "-shared", "-fPIC", "-o", library, source]
    subprocess.run(command, check=True, capture_output=True, text=True)
    return Source(ctypes.CDLL(str(library)), prefix)


class Source:
    """Functions of a compiled source, called with their state."""

    def __init__(self, library, prefix):
        self.library, self.prefix = library, prefix
        self.state = (ctypes.c_double * 40_000)()  # larger than any state here, and aligned

    def __getattr__(self, name):
        function = getattr(self.library, f"{self.prefix}_{name}")
        function.restype = None if name == "init" else ctypes.c_double

        def call(*values):
            return function(
                self.state,
                *(v if isinstance(v, ctypes.Array) else ctypes.c_double(v) for v in values),
            )

        return call
