"""Export of ink tables to ray tracers."""

from jaxink.export.formats import FORMATS, write
from jaxink.export.limitations import LOSSES, ExportOptions

__all__ = ["FORMATS", "LOSSES", "ExportOptions", "write"]
