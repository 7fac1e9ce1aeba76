"""Export of ink tables to ray tracers."""

from jaxink.export.formats import FORMATS, refuse_expected, require_format, write, write_folder
from jaxink.export.guide import warning_of
from jaxink.export.limitations import LOSSES, ExportOptions, LossRefusedError
from jaxink.export.medium import medium_of
from jaxink.export.preparation import least_bin_deg
from jaxink.export.volume import VOLUME_FORMATS, write_volume

__all__ = [
    "FORMATS",
    "LOSSES",
    "VOLUME_FORMATS",
    "ExportOptions",
    "LossRefusedError",
    "least_bin_deg",
    "medium_of",
    "refuse_expected",
    "require_format",
    "warning_of",
    "write",
    "write_folder",
    "write_volume",
]
