"""The BSDF of the ink alone, for light inside the plate.

Names are imported on first use: tables and the choice of the ink need no JAX.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

_HOMES = {
    "jaxink.ink.table": ("COMPONENTS", "InkTable", "read_ink_table"),
    "jaxink.ink.tabulate": ("TableOptions", "ink_table"),
    "jaxink.ink.verification": ("SheetCheck", "SheetVerification", "verify_sheet"),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

if TYPE_CHECKING:
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


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'jaxink.ink' has no attribute {name!r}")
    return getattr(import_module(_HOME_OF[name]), name)


def __dir__() -> list[str]:
    return __all__
