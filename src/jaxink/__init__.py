"""Optical properties of printed and painted inks from goniometer measurements.

Names are imported on first use, which keeps ``import jaxink`` fast.
"""

from typing import Any

import lazy_loader

_import, _, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from jaxink.files.version import installed_version

        return installed_version()
    from jaxink.display.signature import shortly_signed

    globals()[name] = shortly_signed(_import(name))
    return globals()[name]


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
