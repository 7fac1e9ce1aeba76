"""All methods by name."""

from jaxink.fitting.gradient import Gradient
from jaxink.fitting.method import Method
from jaxink.fitting.optimistix_methods import (
    OptimistixBfgs,
    OptimistixDogleg,
    OptimistixLevenbergMarquardt,
    OptimistixNelderMead,
)
from jaxink.fitting.scipy_methods import (
    Cobyla,
    Cobyqa,
    DifferentialEvolution,
    Dogbox,
    LimitedMemoryBfgs,
    Powell,
    Simplex,
    TrustRegionReflective,
)

METHODS: dict[str, type[Method]] = {
    method.name: method
    for method in (
        Gradient,
        Simplex,
        Powell,
        Cobyla,
        Cobyqa,
        DifferentialEvolution,
        LimitedMemoryBfgs,
        TrustRegionReflective,
        Dogbox,
        OptimistixLevenbergMarquardt,
        OptimistixDogleg,
        OptimistixBfgs,
        OptimistixNelderMead,
    )
}
