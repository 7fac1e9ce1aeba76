"""Mitsuba 3, an optional package, with the plug-in for tables of inks."""

import importlib.util
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from jaxink.errors import InputRefusedError

_VARIANT = "scalar_rgb"
_PLUGIN = "jaxink_table"


def require_mitsuba() -> Any:
    """The package.

    Raises
    ------
    InputRefusedError
        If it is not installed.
    """
    try:
        import mitsuba
    except ImportError:
        raise InputRefusedError(
            "the sphere is rendered by the package mitsuba, which is not installed; run "
            "`pip install 'jaxink[render]'`."
        ) from None
    return mitsuba


@contextmanager
def mitsuba() -> Iterator[Any]:
    """The package, with a scalar variant set; afterwards the variant is what it was.

    Raises: see `require_mitsuba`.
    """
    mi = require_mitsuba()
    before = mi.variant()
    mi.set_variant(_VARIANT)
    try:
        yield mi
    finally:
        if before is not None:
            mi.set_variant(before)


def with_table_plugin(mi: Any, written: Mapping[str, Sequence[Path]]) -> dict[str, Path]:
    """Register the BSDF plug-in that stands beside exported tables; the table of each export.

    Parameters
    ----------
    mi
        The package, in the variant that the plug-in is for.
    written
        By name, what `jaxink.export.write` has written for Mitsuba.
    """
    assert mi.variant() == _VARIANT, "the plug-in is of the variant that is set"
    (plugin,) = {file for files in written.values() for file in files if file.stem == _PLUGIN}
    spec = importlib.util.spec_from_file_location(_PLUGIN, plugin)
    assert spec is not None, "the export contains the plug-in"
    assert spec.loader is not None, "a Python file has a loader"
    spec.loader.exec_module(importlib.util.module_from_spec(spec))
    return {name: next(f for f in files if f.suffix == ".nc") for name, files in written.items()}
