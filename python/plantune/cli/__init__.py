"""The command line: parses, calls, prints."""

from plantune.cli import convert as convert  # a command is there once its file is loaded
from plantune.cli import design as design
from plantune.cli import export as export
from plantune.cli import identify as identify
from plantune.cli import inspect as inspect
from plantune.cli import simulate as simulate
from plantune.cli import watch as watch
from plantune.cli.main import main

__all__ = ["main"]
