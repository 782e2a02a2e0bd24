"""A look before anything is decided: what a file holds, what its record shows, what to do next."""

from plantune.inspection.files import ColumnSeen as ColumnSeen
from plantune.inspection.files import FileSeen as FileSeen
from plantune.inspection.files import Stamps as Stamps
from plantune.inspection.inspection import Inspection as Inspection
from plantune.inspection.inspection import inspect as inspect
