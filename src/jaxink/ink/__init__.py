"""The BSDF of the ink alone, for light inside the plate."""

from jaxink.ink.table import COMPONENTS, InkTable, read_ink_table
from jaxink.ink.tabulate import TableOptions, ink_table
from jaxink.ink.verification import SheetCheck, SheetVerification, verify_sheet

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
