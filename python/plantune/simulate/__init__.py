"""Closed loops and relay tests with the exact delay."""

from plantune.simulate.actuator import Actuator
from plantune.simulate.closed_loop import Indices, Response, closed_loop, load_step, step
from plantune.simulate.relay import relay
from plantune.simulate.schedule import Schedule, Table
from plantune.simulate.varying import VaryingPlant

__all__ = [
    "Actuator",
    "Indices",
    "Response",
    "Schedule",
    "Table",
    "VaryingPlant",
    "closed_loop",
    "load_step",
    "relay",
    "step",
]
