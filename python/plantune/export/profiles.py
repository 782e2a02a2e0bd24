"""Profiles of controllers: what stands on their faceplates, read from `vendors/*.json`.

A profile is data; the arithmetic is one conversion of the core for all of them.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from plantune.errors import refusal


@dataclass(frozen=True, slots=True)
class Setting:
    """One setting of a controller.

    Attributes
    ----------
    name : str
        On the controller; empty for what is built in.
    quantity : str
        `Kp PB Ti Ki Td Kd Tf b c`, `Tf/Td`, `Td/Tf`, or "constant".
    unit : str
        "", "%", "s", "min", "1/s", "1/min", "repeats/min", "samples", "1/sample".
    digits, decimals : int or None
        Significant digits kept, or digits behind the point; 7 significant ones by default.
    fixed, default : float or None
        A value that is not chosen; a value where the design leaves it open.
    off : float or None
        The value that means no integral action.
    range : (low, high) or None
        What the controller takes.
    """

    name: str
    quantity: str
    unit: str = ""
    digits: int | None = None
    decimals: int | None = None
    fixed: float | None = None
    default: float | None = None
    off: float | None = None
    range: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Profile:
    """How a controller wants its settings.

    Attributes
    ----------
    name, title : str
        As `vendor` takes it, and in words.
    form : "ideal", "parallel" or "series"
        Form of its equation.
    gain : "span", "output" or "engineering"
        Gains in percent per percent, in percent of the output per unit of y, or in u/y.
    signed : bool
        Whether gains may be negative; else the sign is the action.
    reverse, direct : str
        How it is told that its action is reverse (a positive gain) or direct.
    settings : tuple of Setting
        In the order of its faceplate.
    setup : str
        The options that make it this equation.
    level : "verified" or "unverified"
        Verified where the equation was read in the vendor's own public text.
    source, checked : str
        That text, and what was read in it and what was not.
    aliases : tuple of str
        Other names.

    Examples
    --------
    >>> import plantune as pt
    >>> profile = next(p for p in pt.export.vendors() if p.name == "rockwell-pide")
    >>> print(profile)
    rockwell-pide: Rockwell Logix PIDE, independent gains (parallel form, verified)
    """

    name: str
    title: str
    form: str
    gain: str
    signed: bool
    reverse: str
    direct: str
    settings: tuple[Setting, ...]
    setup: str
    level: str
    source: str
    checked: str
    aliases: tuple[str, ...] = ()

    def __str__(self) -> str:
        return f"{self.name}: {self.title} ({self.form} form, {self.level})"


def vendors() -> tuple[Profile, ...]:
    """Return the profiles that `vendor` knows, by their names.

    Examples
    --------
    >>> import plantune as pt
    >>> [profile.name for profile in pt.export.vendors() if profile.level == "verified"]
    ['embedded', 'rockwell-pide', 'rockwell-pide-dependent', 'siemens-pid-compact']
    """
    return _profiles()


def profile_of(name: str) -> Profile:
    """Return the profile of that name."""
    for profile in vendors():
        if name == profile.name or name in profile.aliases:
            return profile
    known = ", ".join(profile.name for profile in vendors())
    raise refusal(
        "U01",
        f"no controller {name!r} is known",
        remedy=f"take one of {known}; or a form: ideal, parallel, series, pb, velocity",
    )


@cache
def _profiles() -> tuple[Profile, ...]:
    folder = files("plantune.export") / "vendors"
    found = sorted((file for file in folder.iterdir() if file.name.endswith(".json")), key=_name)
    return tuple(_profile(_name(file), json.loads(file.read_text("utf-8"))) for file in found)


def _name(file: Any) -> str:
    return str(file.name.removesuffix(".json"))


def _profile(name: str, values: dict[str, Any]) -> Profile:
    settings = tuple(_setting(fields) for fields in values.pop("settings"))
    aliases = tuple(values.pop("aliases", ()))
    return Profile(name=name, settings=settings, aliases=aliases, **values)


def _setting(fields: dict[str, Any]) -> Setting:
    span = fields.pop("range", None)
    return Setting(**fields, range=span and (span[0], span[1]))
