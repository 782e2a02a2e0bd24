"""The command line: parses, calls, prints."""

from plantune.cli.main import main

__all__ = ["main"]
