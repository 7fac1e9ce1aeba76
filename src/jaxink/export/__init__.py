"""Export of ink tables to ray tracers."""

from jaxink.export.formats import FORMATS, refuse_expected, require_format, write, write_folder
from jaxink.export.guide import warning_of
from jaxink.export.limitations import LOSSES, ExportOptions, LossRefusedError
from jaxink.export.medium import Medium, medium_of
from jaxink.export.preparation import least_bin_deg
from jaxink.export.volume import VOLUME_FORMATS, even_table, write_volume

__all__ = [
    "ExportOptions",
    "FORMATS",
    "LOSSES",
    "LossRefusedError",
    "Medium",
    "VOLUME_FORMATS",
    "even_table",
    "least_bin_deg",
    "medium_of",
    "refuse_expected",
    "require_format",
    "warning_of",
    "write",
    "write_folder",
    "write_volume",
]
