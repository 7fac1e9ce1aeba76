"""The slab solver: from a stack of layers to its BSDF; names are imported on first use."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from jaxink.solver.accuracy import DEFAULT_ACCURACY, require_accuracy
    from jaxink.solver.bsdf import diffuse_bsdf, hemispherical_power, regular_power
    from jaxink.solver.collected import CollectedLight, collected_light
    from jaxink.solver.config import SolverConfig
    from jaxink.solver.fluence_rate import DEPTH_WEIGHTS, fluence
    from jaxink.solver.lateral import N_FREQUENCIES, LateralField
    from jaxink.solver.layer_response import LAYER_METHODS, layer_method
    from jaxink.solver.plan import ChannelPlan, plan_channels, plan_media
    from jaxink.solver.resolution import choose_sizes, demand, require_resolvable, sizes_for
    from jaxink.solver.specular import regular_fields
    from jaxink.solver.stack import Stack
    from jaxink.solver.two_orders import polarised_excess

_HOMES = {
    "jaxink.solver.accuracy": (
        "DEFAULT_ACCURACY",
        "require_accuracy",
    ),
    "jaxink.solver.bsdf": (
        "diffuse_bsdf",
        "hemispherical_power",
        "regular_power",
    ),
    "jaxink.solver.collected": (
        "CollectedLight",
        "collected_light",
    ),
    "jaxink.solver.config": ("SolverConfig",),
    "jaxink.solver.fluence_rate": (
        "DEPTH_WEIGHTS",
        "fluence",
    ),
    "jaxink.solver.lateral": (
        "LateralField",
        "N_FREQUENCIES",
    ),
    "jaxink.solver.layer_response": (
        "LAYER_METHODS",
        "layer_method",
    ),
    "jaxink.solver.plan": (
        "ChannelPlan",
        "plan_channels",
        "plan_media",
    ),
    "jaxink.solver.resolution": (
        "choose_sizes",
        "demand",
        "require_resolvable",
        "sizes_for",
    ),
    "jaxink.solver.specular": ("regular_fields",),
    "jaxink.solver.stack": ("Stack",),
    "jaxink.solver.two_orders": ("polarised_excess",),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

__all__ = sorted(_HOME_OF)


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'jaxink.solver' has no attribute {name!r}")
    return getattr(import_module(_HOME_OF[name]), name)


def __dir__() -> list[str]:
    return __all__
