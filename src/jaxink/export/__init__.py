"""The ink as seen from inside the plate, as a table and in the files of ray tracers."""

from jaxink.export.inside import TableOptions, ink_table
from jaxink.export.losses import LOSSES, ExportOptions
from jaxink.export.netcdf import read_ink_table
from jaxink.export.table import COMPONENTS, InkTable
from jaxink.export.verification import SheetCheck, SheetVerification, verify_sheet
from jaxink.export.writing import FORMATS, write

__all__ = [
    "COMPONENTS",
    "FORMATS",
    "LOSSES",
    "ExportOptions",
    "InkTable",
    "SheetCheck",
    "SheetVerification",
    "TableOptions",
    "ink_table",
    "read_ink_table",
    "verify_sheet",
    "write",
]
