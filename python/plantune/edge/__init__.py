"""Links to plants and controllers, and flags that say which signal goes where."""

from plantune.edge.flags import Flags
from plantune.edge.links import (
    Capabilities,
    FlaggedLink,
    Link,
    RecordedPlant,
    SimulatedPlant,
)
from plantune.edge.record import record
from plantune.edge.run import run

__all__ = [
    "Capabilities",
    "FlaggedLink",
    "Flags",
    "Link",
    "RecordedPlant",
    "SimulatedPlant",
    "record",
    "run",
]
