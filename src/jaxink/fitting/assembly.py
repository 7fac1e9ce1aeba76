"""Assembles the result of a fit from its searches, with independent checks of what the model assumes."""

import dataclasses
from collections.abc import Mapping, Sequence

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from jaxink.display.brief import brief_repr, counted
from jaxink.effects import AugmentedModel, Polarisation
from jaxink.files.version import installed_version
from jaxink.fitting.colouring import Colouring
from jaxink.fitting.comparison_methods import METHODS
from jaxink.fitting.compiled import split, without_values
from jaxink.fitting.derived import OPTICAL_PROPERTIES, DerivedQuantity
from jaxink.fitting.endings import Ending, minima_of, noise_scale
from jaxink.fitting.figures_of_merit import merit, merit_by_scan, rms
from jaxink.fitting.fit_objective import FitObjective
from jaxink.fitting.fitted_parameters import FittedParameter, FittedParameters
from jaxink.fitting.minima import Minima
from jaxink.fitting.objective import Objective
from jaxink.fitting.options import FitOptions
from jaxink.fitting.outcome import Outcome, Search, SearchPath
from jaxink.fitting.readings_result import ReadingsResult
from jaxink.fitting.result import (
    FitResult,
    MieCheck,
    NeglectedPolarisation,
    PathSummary,
    ProfileCurve,
    SearchSummary,
)
from jaxink.fitting.uncertainty import Covariance, Profile
from jaxink.measurement import FitNoise, GonioData, Readings
from jaxink.model import ForwardModel, mie_sizes, why_not_polarised
from jaxink.numerics.compiling import jit_unoptimised
from jaxink.numerics.failures import Failures
from jaxink.numerics.fingerprint import fingerprint
from jaxink.numerics.weak_cache import WeakCache
from jaxink.particles import difference_from_miepython
from jaxink.sample import Parameter, Sample
from jaxink.solver import layer_method

PACKAGES = ("jaxink", "jax", "jaxlib", "equinox", "optimistix", "numpy", "scipy")
# More spheres are left out at equal intervals: those of neighbouring wavelengths are alike.
_MOST = 64
# Note on a search that ended where it started.
UNMOVED = "No parameter moved from its start value."


@dataclasses.dataclass(frozen=True)
class Found:
    """What the searches of a fit found.

    Parameters
    ----------
    best
        The search with the lowest loss.
    errors
        Covariance there; None if the objective is not chi-square or the method has no Jacobian.
    searches
        All single searches.
    series
        The sweep and the profiles, the searches of each combined into one.
    endings
        Where searches ended, to be sorted into minima; empty if nothing is to be said of these.
    profiles
        Chi-square along the weakly determined parameters.
    n_not_profiled
        Number of weakly determined parameters that were left out because there are too many.
    failures
        Parts of the fit that failed after its searches.
    is_from_search
        Whether the values of the sample are themselves the end of a search.
    """

    __repr__ = brief_repr

    best: Search
    errors: Covariance | None
    searches: tuple[Search, ...]
    series: tuple[Search, ...] = ()
    endings: tuple[Ending, ...] = ()
    profiles: tuple[Profile, ...] = ()
    n_not_profiled: int = 0
    failures: Failures = dataclasses.field(default_factory=Failures)
    is_from_search: bool = False

    def for_noise_of(self, degrees_of_freedom: float) -> "Found":
        """With standard errors that know how well the noise is known; see `Covariance.for_noise_of`."""
        if self.errors is None:
            return self
        return dataclasses.replace(self, errors=self.errors.for_noise_of(degrees_of_freedom))


def assemble(
    data: GonioData, sample: Sample, options: FitOptions, noise: FitNoise, objective: Objective, found: Found
) -> FitResult:
    """The result of a fit, given its input, the objective at the final resolution, and what was found."""
    best, errors, free = found.best, found.errors, sample.parameters.free
    values = sample.parameters.values_with(objective.numbers(best.unit))
    whitened = None
    if noise.known:
        whitened = np.asarray(objective.in_noise(best.predicted, objective.measured - best.predicted))
    config = objective.model.config
    polarisation: NeglectedPolarisation | None = None
    with found.failures.sparing("the estimate of neglected polarisation", ""):
        polarisation = neglected_polarisation(sample, objective, best)
    check: MieCheck | None = None
    with found.failures.sparing("the comparison with miepython", ""):
        check = mie_check(sample, values, objective.model.wavelengths_nm)
    derived: tuple[DerivedQuantity, ...] = ()
    with found.failures.sparing("the calculation of derived quantities", ""):
        derived = _derived(objective, best, errors)
    minima: Minima | None = None
    if found.endings:
        with found.failures.sparing("the list of minima", ""):
            freedom = max(objective.n_rows - len(free), 1)
            scale = noise_scale(best.loss, freedom, options.objective == "chi_square")
            minima = minima_of(found.endings, best, scale, objective.numbers)
    said = [failure.sentence for failure in found.failures.found]
    if polarisation is not None:
        said.insert(0, polarisation.sentence)
    if check is not None and check.warning is not None:
        said.insert(0, check.warning)
    return FitResult(
        sample=_with_values(sample, objective, best),
        data=data,
        predicted_per_sr=best.predicted,
        sigma_per_sr=np.asarray(noise.sigma_per_sr),
        whitened=whitened,
        method=options.method,
        objective=options.objective,
        outcome=best.outcome,
        parameters=_fitted_parameters(sample, objective, found, minima),
        correlation_names=() if errors is None else tuple(p.name for p in free),
        correlations=np.zeros((0, 0)) if errors is None else errors.correlation,
        derived=derived,
        merit=merit(data, best.predicted, whitened, len(free), noise.degrees_of_freedom),
        scans=merit_by_scan(data, best.predicted, whitened),
        noise={
            "origin": noise.origin,
            "scan_relative": noise.scan_relative,
            "known": noise.known,
            "level": noise.level,
        },
        searches=tuple(search_summary(s, objective) for s in (*found.searches, *found.series)),
        profiles=tuple(profile_curve(p, objective, best) for p in found.profiles),
        solver=dataclasses.asdict(config) | {"layer_method": layer_method(config.layer_method)},
        versions={name: installed_version(name) for name in PACKAGES},
        seed=options.seed,
        notes=(
            *data.notes,
            *notes_of(free, objective, options, found),
            *(minima.rivals(options.objective == "chi_square") if minima is not None else ()),
            *said,
        ),
        neglected_polarisation=polarisation,
        mie_check=check,
        minima=minima,
    )


def _with_values(sample: Sample, objective: Objective, best: Search) -> Sample:
    """The sample with the fitted values."""
    return dataclasses.replace(sample, parameters=sample.parameters.at(objective.numbers(best.unit)))


def _fitted_parameters(
    sample: Sample, objective: Objective, found: Found, minima: Minima | None
) -> FittedParameters:
    """All parameters of a sample after the fit."""
    fitted = objective.numbers(found.best.unit)
    values, start = (sample.parameters.values_with(given) for given in (fitted, {}))
    return FittedParameters.of(
        tuple(
            fitted_parameter(p, float(values[p.name]), float(start[p.name]), objective, found, minima)
            for p in sample.parameters.values()
        )
    )


def readings_result(
    readings: Readings,
    sample: Sample,
    options: FitOptions,
    noise: FitNoise,
    objective: Objective,
    found: Found,
) -> ReadingsResult:
    """Readings as a joint fit predicts them; parameters as for `assemble`."""
    predicted = found.best.predicted
    return ReadingsResult(
        sample=_with_values(sample, objective, found.best),
        data=readings,
        predicted=predicted,
        sigma=np.asarray(noise.sigma_per_sr),
        whitened=np.asarray(objective.in_noise(predicted, objective.measured - predicted)),
        objective=options.objective,
        outcome=found.best.outcome,
        parameters=_fitted_parameters(sample, objective, found, None),
        noise={"origin": noise.origin, "scan_relative": noise.scan_relative, "known": True, "level": None},
        config=objective.model.config,
    )


def profile_curve(profile: Profile, objective: FitObjective, best: Search) -> ProfileCurve:
    """A profile as it is kept in a result."""
    values = tuple(_physical(objective, profile.position, u, best) for u in profile.unit)
    return ProfileCurve(objective.free[profile.position], values, tuple(float(r) for r in profile.rise))


def _physical(objective: FitObjective, position: int, unit: float, best: Search) -> float:
    variables = np.array(best.unit)
    variables[position] = unit
    return float(objective.scale.to_physical(variables)[position])


def fitted_parameter(
    parameter: Parameter,
    value: float,
    start: float,
    objective: FitObjective,
    found: Found,
    minima: Minima | None,
) -> FittedParameter:
    """A parameter with its fitted value, its standard error and what limits it."""
    name = parameter.name
    row = FittedParameter(
        name=name,
        unit=parameter.unit,
        value=value,
        standard_error=None,
        start=start,
        minimum=parameter.minimum,
        maximum=parameter.maximum,
        free=parameter.free,
        tie=parameter.tie,
    )
    if not parameter.free:
        return row
    row = _judged(row, objective.free.index(name), objective, found)
    return dataclasses.replace(row, over_minima=minima.spread(name) if minima is not None else None)


def _judged(row: FittedParameter, position: int, objective: FitObjective, found: Found) -> FittedParameter:
    """Standard error, bound and profile of one free parameter."""
    best, errors = found.best, found.errors
    unit = best.unit[position]
    # The unit variable of a one-minus scale also increases with the parameter: bounds keep their names.
    flag = "at lower bound" if unit <= 0 else "at upper bound" if unit >= 1 else ""
    error = interval = None
    if errors is not None and not errors.held[position]:
        deviation = errors.deviation[position] * abs(objective.scale.slope(best.unit)[position])
        error = float(deviation) if np.isfinite(deviation) else None
    curve = next((profile for profile in found.profiles if profile.position == position), None)
    if curve is not None:
        ends = [_physical(objective, position, u, best) for u in (curve.lower, curve.upper)]
        interval = (min(ends), max(ends))
        flag = (
            flag
            or {
                (True, True): "not determined",
                (True, False): "open below",
                (False, True): "open above",
                (False, False): "",
            }[curve.open_below, curve.open_above]
        )
    elif error is None and not flag and errors is not None:
        flag = "not determined"
    return dataclasses.replace(row, standard_error=error, flag=flag, interval=interval)


@eqx.filter_jit
def _coefficients(objective: Objective, unit, seeds):
    """Coefficients of the layers, and their derivatives along directions."""

    def of(unit):
        return objective.model.coefficients(objective.given(objective.scale.to_physical(unit)))

    def along(seed):
        return jax.jvp(of, (unit,), (seed,))

    return jax.vmap(along, out_axes=(None, 1))(seeds)


def _derived(objective: Objective, best: Search, errors: Covariance | None) -> tuple[DerivedQuantity, ...]:
    colouring = Colouring.of(objective)
    at = jnp.asarray(best.unit), jnp.asarray(colouring.seeds)
    values, slopes = _coefficients(without_values(objective), *at)
    rows = []
    for layer, coefficients in values.items():
        for i, wavelength in enumerate(objective.model.wavelengths_nm):
            for quantity in OPTICAL_PROPERTIES:
                value = float(getattr(coefficients, quantity)[i])
                if not np.isfinite(value):
                    continue
                along = np.asarray(getattr(slopes[layer], quantity)[i])
                slope = colouring.expand_at(along, wavelength)
                rows.append(DerivedQuantity(layer, wavelength, quantity, value, _propagated(slope, errors)))
    return tuple(rows)


def _propagated(slope: np.ndarray, errors: Covariance | None) -> float | None:
    """Standard error of a function of the parameters."""
    if errors is None:
        return None
    matters = np.abs(slope) > 1e-12 * (np.max(np.abs(slope)) + 1e-300)
    block = errors.matrix[np.ix_(matters, matters)]
    if not np.all(np.isfinite(block)):
        return None
    return float(np.sqrt(max(slope[matters] @ block @ slope[matters], 0.0)))


def search_summary(search: Search, objective: FitObjective) -> SearchSummary:
    """A search as it is kept in a result."""
    names = {field.name for field in dataclasses.fields(SearchSummary)}
    return SearchSummary(
        **{name: value for name, value in vars(search).items() if name in names}
        | {
            "outcome": search.outcome.code,
            "start": objective.numbers(search.start),
            "values": objective.numbers(search.unit),
            "path": _path(search.path, objective),
        }
    )


def _path(path: SearchPath, objective: FitObjective) -> PathSummary:
    values = np.array([objective.scale.to_physical(unit) for unit in path.unit]).T
    return PathSummary(
        evaluations=tuple(path.evaluations.tolist()),
        jacobians=tuple(path.jacobians.tolist()),
        seconds=tuple(path.seconds.tolist()),
        loss=tuple(path.loss.tolist()),
        values=dict(zip(objective.free, map(tuple, values.tolist()), strict=True)),
    )


def notes_of(
    free: Sequence[Parameter], objective: FitObjective, options: FitOptions, found: Found
) -> list[str]:
    """Remarks on the searches."""
    notes = []
    if found.errors is None and not METHODS[options.method].has_jacobian:
        title = METHODS[options.method].title
        notes.append(f"The {title} has no Jacobian, so there are no standard errors.")
    elif found.best.outcome is Outcome.GOAL:
        notes.append("The fit stopped at its goal, not in a minimum, so there are no standard errors.")
    elif found.errors is None:
        notes.append(
            f"The objective '{options.objective}' is not chi-square, so there are no standard errors."
        )
    # Compared with the sample's start: a search may have continued from the end of another one.
    first = objective.scale.to_unit(np.array([p.value for p in free]))
    if not found.is_from_search and np.allclose(found.best.unit, first):
        notes.append(_unmoved(found))
    if found.n_not_profiled:
        notes.append(
            f"Profile likelihoods follow the {counted(len(found.profiles), 'parameter')} determined least; "
            f"{counted(found.n_not_profiled, 'other')} weakly determined, too, "
            f"{'has' if found.n_not_profiled == 1 else 'have'} the standard error of the covariance only "
            '(profile="all", or --profile all, follows every parameter).'
        )
    return notes


def _unmoved(found: Found) -> str:
    """Why the best values are those of the start: searches from elsewhere may have found nothing better."""
    others = sum(not np.allclose(search.start, found.best.unit) for search in found.searches)
    if not others:
        return UNMOVED
    return (
        f"The start values are the best found: {others} search{'es' * (others != 1)} from elsewhere ended "
        "no lower."
    )


def mie_check(
    sample: Sample, values: Mapping[str, float], wavelengths_nm: tuple[float, ...]
) -> MieCheck | None:
    """How far the Mie series at the solution is from miepython's; None without Mie particles.

    Compared are the spheres of each population at each wavelength: that of the radius, of distributed ones
    also those a standard deviation to either side of it, and of tabulated radii all.

    Parameters
    ----------
    sample
        With the layers.
    values
        Value of every parameter, by name.
    wavelengths_nm
        In vacuum.
    """
    spheres: list[tuple[float, complex]] = []
    for wavelength in wavelengths_nm:
        here = sample.at_wavelength(values, wavelength)
        for layer in sample.layers:
            if layer.phase_function != "mie":
                continue
            binder = float(here[f"{layer.name}.refractive_index"])
            for kind, table in layer.particles.items():
                index = here[f"{kind}.particle_index"] + 1j * here[f"{kind}.particle_absorption_index"]
                for radius in _radii_nm(kind, table, here):
                    spheres.append((2 * np.pi * radius * binder / wavelength, complex(index / binder)))
    if not spheres:
        return None
    largest = mie_sizes(sample, wavelengths_nm).max_size_parameter
    # The model has none that is larger.
    sizes = np.minimum([x for x, _ in spheres], largest)
    indices = np.array([m for _, m in spheres])
    some = slice(None, None, -(-len(spheres) // _MOST))
    found = difference_from_miepython(sizes[some], indices[some], largest)
    return MieCheck(len(found), float(np.max(found)))


def _radii_nm(kind: str, table, values: Mapping[str, float]) -> list[float]:
    if table is not None:
        return list(table[0])
    radius = float(values[f"{kind}.radius_nm"])
    variance = values.get(f"{kind}.radius_variance_ln")
    if variance is None:
        return [radius]
    deviation = float(np.sqrt(variance))
    return [radius * float(np.exp(step * deviation)) for step in (-1, 0, 1)]


def neglected_polarisation(
    sample: Sample, objective: Objective, best: Search
) -> NeglectedPolarisation | None:
    """What polarisation would change at the solution; None if it is unknown or part of the model."""
    model = objective.model
    if not isinstance(model, ForwardModel | AugmentedModel):
        return None
    if why_not_polarised(sample) or Polarisation.name in (effect.name for effect in sample.effects):
        return None
    arrays, *static = split(objective)
    excess = _program(*static)(arrays, jnp.asarray(best.unit))
    relative = np.asarray(excess) / best.predicted
    return NeglectedPolarisation(rms(relative), float(np.max(np.abs(relative))))


@WeakCache
def _program(treedef, leaves):
    static = jax.tree.unflatten(treedef, leaves)

    def excess(arrays, unit):
        objective = eqx.combine(arrays, static)
        return objective.model.polarised_excess(objective.given(objective.scale.to_physical(unit)))

    key = fingerprint(static)
    return jit_unoptimised(excess, key=key and fingerprint(key, "polarised excess"))
