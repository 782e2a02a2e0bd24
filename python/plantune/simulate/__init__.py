"""Closed loops and relay tests with the exact delay."""

from plantune.simulate.closed_loop import Indices, Response, closed_loop, load_step, step
from plantune.simulate.relay import relay

__all__ = ["Indices", "Response", "closed_loop", "load_step", "relay", "step"]
