"""The ink as seen from inside the plate, as a table and in the files of ray tracers."""

from jaxink.export.inside import TableOptions, ink_table
from jaxink.export.netcdf import read_ink_table
from jaxink.export.table import COMPONENTS, InkTable
from jaxink.export.verification import SheetCheck, SheetVerification, verify_sheet

__all__ = [
    "COMPONENTS",
    "InkTable",
    "SheetCheck",
    "SheetVerification",
    "TableOptions",
    "ink_table",
    "read_ink_table",
    "verify_sheet",
]
