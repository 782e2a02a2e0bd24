"""Records to try: two that were measured, and simulations whose truth is known."""

from plantune.datasets.engine import ENGINE_LOOP, EngineLoop, engine_loop
from plantune.datasets.measured import hair_dryer, robot_arm
from plantune.datasets.motor import DRIVES, PRINTER_MOTOR, PrinterMotor, printer_motor
from plantune.datasets.stage import PIEZO_STAGE, PiezoStage, piezo_stage

__all__ = [
    "DRIVES",
    "ENGINE_LOOP",
    "PIEZO_STAGE",
    "PRINTER_MOTOR",
    "EngineLoop",
    "PiezoStage",
    "PrinterMotor",
    "engine_loop",
    "hair_dryer",
    "piezo_stage",
    "printer_motor",
    "robot_arm",
]
