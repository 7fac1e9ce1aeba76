"""The BSDF of the ink alone, for light inside the plate.

Names are imported on first use: tables and the choice of the ink need no JAX.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jaxink.ink.areas import apart_from_the_ink
    from jaxink.ink.boundary import boundary_table
    from jaxink.ink.boundary_file import RoughBoundary, load_boundary
    from jaxink.ink.boundary_validity import INCIDENCES_DEG, validity_checks
    from jaxink.ink.comparison import LARGEST_THETA_DEG, TableComparison, compare_tables
    from jaxink.ink.foresight import NEGLIGIBLE, SAME_INDEX, ExpectedTable, expected_boundary, expected_table
    from jaxink.ink.hemispherical_totals import (
        azimuth_weights,
        critical_angle_deg,
        diffuse_totals,
        excess_of_power,
        exit_angles_deg,
        power_sent_out,
        projected_weights,
    )
    from jaxink.ink.ink_layers import InkChoice, InkLayers, UnclearInkError, find_ink
    from jaxink.ink.polar_grid import linear_matrix
    from jaxink.ink.saved_fit import read_saved_fit
    from jaxink.ink.table import COMPONENTS, InkTable, read_ink_table
    from jaxink.ink.tabulate import TableOptions, ink_table
    from jaxink.ink.verification import SheetCheck, SheetVerification, verify_sheet

_HOMES = {
    "jaxink.ink.areas": ("apart_from_the_ink",),
    "jaxink.ink.boundary": ("boundary_table",),
    "jaxink.ink.boundary_file": (
        "RoughBoundary",
        "load_boundary",
    ),
    "jaxink.ink.boundary_validity": (
        "INCIDENCES_DEG",
        "validity_checks",
    ),
    "jaxink.ink.comparison": (
        "LARGEST_THETA_DEG",
        "TableComparison",
        "compare_tables",
    ),
    "jaxink.ink.foresight": (
        "ExpectedTable",
        "NEGLIGIBLE",
        "SAME_INDEX",
        "expected_boundary",
        "expected_table",
    ),
    "jaxink.ink.hemispherical_totals": (
        "azimuth_weights",
        "critical_angle_deg",
        "diffuse_totals",
        "excess_of_power",
        "exit_angles_deg",
        "power_sent_out",
        "projected_weights",
    ),
    "jaxink.ink.ink_layers": (
        "InkChoice",
        "InkLayers",
        "UnclearInkError",
        "find_ink",
    ),
    "jaxink.ink.polar_grid": ("linear_matrix",),
    "jaxink.ink.saved_fit": ("read_saved_fit",),
    "jaxink.ink.table": (
        "COMPONENTS",
        "InkTable",
        "read_ink_table",
    ),
    "jaxink.ink.tabulate": (
        "TableOptions",
        "ink_table",
    ),
    "jaxink.ink.verification": (
        "SheetCheck",
        "SheetVerification",
        "verify_sheet",
    ),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

__all__ = sorted(_HOME_OF)


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'jaxink.ink' has no attribute {name!r}")
    return getattr(import_module(_HOME_OF[name]), name)


def __dir__() -> list[str]:
    return __all__
