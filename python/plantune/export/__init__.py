"""A controller, a plant or an estimator in the language of what it will run in."""

from plantune.export.c_source import c_source
from plantune.export.control import to_control
from plantune.export.profiles import Profile, vendors
from plantune.export.structured_text import structured_text
from plantune.export.vendor import VendorSettings, vendor

__all__ = [
    "Profile",
    "VendorSettings",
    "c_source",
    "structured_text",
    "to_control",
    "vendor",
    "vendors",
]
