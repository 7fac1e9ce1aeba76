"""Optical properties of printed and painted inks from goniometer measurements.

Names are imported on first use, which keeps ``import jaxink`` fast.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

_HOMES = {
    "jaxink.errors": (
        "ForkedProcessError",
        "InputRefusedError",
        "JaxinkError",
        "PlatformError",
        "PrecisionError",
        "UnsafeVersionError",
    ),
    "jaxink.measurement": (
        "GonioData",
        "MaskLimits",
        "NoiseModel",
        "Readings",
        "estimate_noise",
        "read",
        "read_readings",
    ),
    "jaxink.sample": ("Parameter", "Sample", "load_sample", "parse_sample"),
    "jaxink.planning": ("MeasurementPlan", "plan_measurement"),
    "jaxink.projects": ("Project", "load_project", "parse_project"),
    "jaxink.model.forward": ("ForwardModel",),
    "jaxink.solver.config": ("SolverConfig",),
    "jaxink.solver.stack": ("Stack",),
    "jaxink.solver.plan": ("plan_channels",),
    "jaxink.solver.resolution": ("choose_sizes",),
    "jaxink.optics.layers": ("ClearLayer", "ScatteringLayer"),
    "jaxink.particles.phase_function": ("HenyeyGreenstein", "Rayleigh", "TwoTermHenyeyGreenstein"),
    "jaxink.solver.bsdf": ("diffuse_bsdf", "hemispherical_power", "regular_power"),
    "jaxink.optics.directions": ("Directions",),
    "jaxink.ink": ("InkTable", "TableOptions", "ink_table", "read_ink_table"),
    "jaxink.batches": ("Batch", "batch", "load_plan"),
    "jaxink.diagnosis": ("Diagnosis", "DiagnosisOptions", "diagnose", "load_diagnosis"),
    "jaxink.effects": ("Effect", "forward_model"),
    "jaxink.fitting": (
        "FitOptions",
        "FitResult",
        "JointResult",
        "fit",
        "load_joint_result",
        "load_result",
        "predict",
        "predict_at",
    ),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}
_PACKAGES = ("data", "diagnosis", "effects", "errors", "export", "fitting", "plots", "report")

if TYPE_CHECKING:
    from jaxink import data, diagnosis, effects, errors, export, fitting, plots, report
    from jaxink.batches import Batch, batch, load_plan
    from jaxink.diagnosis import Diagnosis, DiagnosisOptions, diagnose, load_diagnosis
    from jaxink.effects import Effect, forward_model
    from jaxink.errors import (
        ForkedProcessError,
        InputRefusedError,
        JaxinkError,
        PlatformError,
        PrecisionError,
        UnsafeVersionError,
    )
    from jaxink.fitting import (
        FitOptions,
        FitResult,
        JointResult,
        fit,
        load_joint_result,
        load_result,
        predict,
        predict_at,
    )
    from jaxink.ink import InkTable, TableOptions, ink_table, read_ink_table
    from jaxink.measurement import (
        GonioData,
        MaskLimits,
        NoiseModel,
        Readings,
        estimate_noise,
        read,
        read_readings,
    )
    from jaxink.model import ForwardModel
    from jaxink.optics import ClearLayer, Directions, ScatteringLayer
    from jaxink.particles import HenyeyGreenstein, Rayleigh, TwoTermHenyeyGreenstein
    from jaxink.planning import MeasurementPlan, plan_measurement
    from jaxink.projects import Project, load_project, parse_project
    from jaxink.sample import Parameter, Sample, load_sample, parse_sample
    from jaxink.solver import (
        SolverConfig,
        Stack,
        choose_sizes,
        diffuse_bsdf,
        hemispherical_power,
        plan_channels,
        regular_power,
    )

    __version__: str

__all__ = sorted(_HOME_OF)


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from jaxink.files.version import installed_version

        return installed_version()
    if name in _PACKAGES:
        return import_module(f"jaxink.{name}")
    if name not in _HOME_OF:
        raise AttributeError(f"module 'jaxink' has no attribute {name!r}")
    from jaxink.display.signature import shortly_signed

    return shortly_signed(getattr(import_module(_HOME_OF[name]), name))


def __dir__() -> list[str]:
    return sorted([*__all__, *_PACKAGES, "__version__"])
