"""The ink's table in the files of ray tracers."""

from jaxink.export.limitations import LOSSES, ExportOptions
from jaxink.export.writing import FORMATS, write

__all__ = ["FORMATS", "LOSSES", "ExportOptions", "write"]
