"""Closed loops with the exact delay."""

from plantune.simulate.closed_loop import Indices, Response, closed_loop, load_step, step

__all__ = ["Indices", "Response", "closed_loop", "load_step", "step"]
