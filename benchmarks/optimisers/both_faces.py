"""A sample lit from both faces as one compiled residual, which methods of optimistix need.

`jaxink.fit` evaluates the measurements of a project one by one instead.
"""

import dataclasses
from collections.abc import Collection, Mapping
from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from benchmarks.validation.published.problems import Problem
from jaxink.fitting import Objective
from jaxink.fitting.objective import compose
from jaxink.fitting.scaling import UnitScale
from jaxink.measurement import GonioData, noise_of
from jaxink.model.forward import ForwardModel
from jaxink.solver.config import SolverConfig


class BothFaces(eqx.Module):
    """One sample lit from both faces: a forward model of each, of the same parameters."""

    models: tuple[ForwardModel, ...]

    @property
    def config(self) -> SolverConfig:
        """Resolution, the same for both."""
        return self.models[0].config

    @property
    def wavelengths_nm(self) -> tuple[float, ...]:
        """Wavelengths of the points, the same for both."""
        return self.models[0].wavelengths_nm

    @property
    def wavelength_of_point_nm(self) -> np.ndarray:
        """Wavelength of each point."""
        return np.concatenate([model.wavelength_of_point_nm for model in self.models])

    @property
    def n_stacks(self) -> int:
        """Number of stacks that one prediction solves."""
        return sum(model.n_stacks for model in self.models)

    def own_wavelengths(self, names: Collection[str]) -> dict[str, float]:
        """See `ForwardModel.own_wavelengths`."""
        return self.models[0].own_wavelengths(names)

    def sizes(self, free_values: Mapping, *options: Any) -> SolverConfig:
        """Resolution that both need; see `ForwardModel.sizes`."""
        first, second = (model.sizes(free_values, *options) for model in self.models)
        return first.at_least(second)

    def bsdf(self, free_values: Mapping | None = None):
        """Predicted BSDF at the points of the first, then of the second."""
        return jnp.concatenate([model.bsdf(free_values) for model in self.models])


def of_both_faces(problem: Problem, config: SolverConfig | None = None) -> Objective:
    """Objective of a problem with two measurements, at a resolution; None: that for the start."""
    measurements = problem.measurements
    models = [ForwardModel(sample, *data.used_directions, config) for data, sample in measurements]
    if config is None:
        config = models[0].config.at_least(models[1].config)
        models = [ForwardModel(sample, *data.used_directions, config) for data, sample in measurements]
    data, sample = _joined([data for data, _ in measurements]), measurements[0][1]
    free = sample.parameters.free
    objective = compose(
        Objective,
        BothFaces(tuple(models)),
        data,
        sample,
        noise_of(data, sample.noise),
        {p.name: p.value for p in sample.parameters.values() if p.is_fixed},
        kind=problem.kind,
        scale=UnitScale.of(free),
        free=tuple(p.name for p in free),
    )
    # Scans of the same incidence and side, lit from different faces, share no factor.
    first = np.arange(len(data)) < len(measurements[0][0])
    _, scan = np.unique(2 * data.scan_index[data.used] + first[data.used], return_inverse=True)
    return dataclasses.replace(objective, scan=scan, n_scans=int(scan.max()) + 1)


def _joined(measurements: list[GonioData]) -> GonioData:
    """Rows of several measurements one after the other."""
    apart = ("extra", "source", "notes", "attrs")
    names = [f.name for f in dataclasses.fields(GonioData) if f.name not in apart]
    columns = {name: np.concatenate([getattr(one, name) for one in measurements]) for name in names}
    return GonioData(**columns, source=" and ".join(one.source for one in measurements))
