"""What all tests share: the record sets beside the repository, and repeatable property tests."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

ROOT = Path(__file__).resolve().parents[1]

# The same examples in every run; no deadline, since a busy machine is no failure.
settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")


@pytest.fixture(scope="session")
def data():
    """Give `data("tclab_step")`, the folder of a record set, or skip where it is absent."""
    root = ROOT / os.environ.get("PLANTUNE_DATA", "../shared/data")

    def folder(name):
        if not (root / name).is_dir():
            pytest.skip(f"record set {name} is not in {root}; PLANTUNE_DATA names the folder")
        return root / name

    return folder
