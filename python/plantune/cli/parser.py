"""What the parser refuses, said as every other refusal: code U01, one remedy, JSON where asked."""

from __future__ import annotations

from typing import Any

import typer
from typer.core import TyperGroup

from plantune.cli.output import fail
from plantune.errors import refusal

_WrongUse: type[Exception] = typer.BadParameter.__mro__[1]  # typer names only what is under it


class Group(TyperGroup):
    """Commands whose wrong use is U01."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Remember how the answer is wanted."""
        ctx.meta["json"] = "--json" in args
        return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        """Run a command, or say why it cannot be run."""
        try:
            return super().invoke(ctx)
        except _WrongUse as error:
            command = getattr(getattr(error, "ctx", None), "command_path", "plantune")
            text = " ".join(error.format_message().split())  # type: ignore[attr-defined]
            wrong = refusal("U01", text, remedy=f"{command} --help lists what there is")
            fail(wrong, ctx.meta["json"])
            raise typer.Exit(wrong.exit_code) from None
