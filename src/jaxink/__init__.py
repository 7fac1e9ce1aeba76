"""Optical properties of printed and painted inks from goniometer measurements.

Names are loaded when first used, so that importing jaxink costs nothing until it computes.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

_HOMES = {
    "jaxink.errors": (
        "ForkedProcessError",
        "InputRefusedError",
        "JaxinkError",
        "PrecisionError",
        "UnsafeVersionError",
    ),
    "jaxink.measurement": ("GonioData", "MaskLimits", "NoiseModel", "estimate_noise", "read"),
    "jaxink.sample": ("Parameter", "Sample", "load_sample", "parse_sample"),
    "jaxink.forward": ("ForwardModel",),
    "jaxink.stack": ("SolverConfig", "Stack"),
    "jaxink.resolution": ("choose_sizes",),
    "jaxink.optics": ("ClearLayer", "ScatteringLayer"),
    "jaxink.bsdf": ("diffuse_bsdf", "hemispherical_power", "regular_power"),
    "jaxink.geometry": ("Directions",),
    "jaxink.export": ("InkTable", "ink_table", "read_ink_table"),
    "jaxink.diagnosis": ("Diagnosis", "DiagnosisOptions", "diagnose"),
    "jaxink.effects": ("Effect",),
    "jaxink.fitting": ("FitOptions", "FitResult", "fit", "load_result", "predict"),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

if TYPE_CHECKING:
    from jaxink.bsdf import diffuse_bsdf, hemispherical_power, regular_power
    from jaxink.diagnosis import Diagnosis, DiagnosisOptions, diagnose
    from jaxink.effects import Effect
    from jaxink.errors import (
        ForkedProcessError,
        InputRefusedError,
        JaxinkError,
        PrecisionError,
        UnsafeVersionError,
    )
    from jaxink.export import InkTable, ink_table, read_ink_table
    from jaxink.fitting import FitOptions, FitResult, fit, load_result, predict
    from jaxink.forward import ForwardModel
    from jaxink.geometry import Directions
    from jaxink.measurement import GonioData, MaskLimits, NoiseModel, estimate_noise, read
    from jaxink.optics import ClearLayer, ScatteringLayer
    from jaxink.resolution import choose_sizes
    from jaxink.sample import Parameter, Sample, load_sample, parse_sample
    from jaxink.stack import SolverConfig, Stack

__all__ = sorted(_HOME_OF)


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'jaxink' has no attribute {name!r}")
    return getattr(import_module(_HOME_OF[name]), name)


def __dir__() -> list[str]:
    return list(__all__)
