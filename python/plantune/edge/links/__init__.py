"""Links to plants: the protocol, a simulated plant, a played record, and both behind flags."""

from plantune.edge.links.flagged import FlaggedLink
from plantune.edge.links.link import Capabilities, Link
from plantune.edge.links.model import SimulatedPlant
from plantune.edge.links.replay import RecordedPlant

__all__ = ["Capabilities", "FlaggedLink", "Link", "RecordedPlant", "SimulatedPlant"]
