"""The ink as seen from inside the plate, as a table and in the files of ray tracers."""

from jaxink.export.losses import LOSSES, ExportOptions
from jaxink.export.table import COMPONENTS, InkTable
from jaxink.export.writing import FORMATS, write

__all__ = ["COMPONENTS", "FORMATS", "LOSSES", "ExportOptions", "InkTable", "write"]
