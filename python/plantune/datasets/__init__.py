"""Records to try: two that were measured, and a simulated loop whose truth is known."""

from plantune.datasets.engine import ENGINE_LOOP, EngineLoop, engine_loop
from plantune.datasets.measured import hair_dryer, robot_arm

__all__ = ["ENGINE_LOOP", "EngineLoop", "engine_loop", "hair_dryer", "robot_arm"]
