"""Fit a sample to a measurement."""

import dataclasses
import logging
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from jaxink.errors import InputRefusedError, require_integer, require_kind, require_one_of
from jaxink.fitting.gradient import GradientSearch, scan, starts, together
from jaxink.fitting.merit import merit, merit_by_scan
from jaxink.fitting.objective import (
    OBJECTIVES,
    FitNoise,
    Objective,
    make_objective,
    noise_of,
)
from jaxink.fitting.outcome import Search
from jaxink.fitting.result import (
    DerivedQuantity,
    FitResult,
    FittedParameter,
    ProfileCurve,
    SearchSummary,
)
from jaxink.fitting.simplex import SimplexSearch
from jaxink.fitting.uncertainty import Covariance, Profile, covariance, profile
from jaxink.measurement import GonioData, MaskLimits, read
from jaxink.measurement.masks import mask_bits
from jaxink.model.forward import ForwardModel, evaluate
from jaxink.numerics.forking import refuse_in_fork
from jaxink.numerics.precision import computing, release_programs
from jaxink.sample import Sample, load_sample
from jaxink.solver.accuracy import DEFAULT_ACCURACY, require_accuracy
from jaxink.solver.layer_response import LAYER_METHODS, layer_method
from jaxink.solver.stack import SolverConfig

_LOG = logging.getLogger("jaxink")
_PACKAGES = ("jaxink", "jax", "jaxlib", "equinox", "optimistix", "numpy", "scipy")
# A standard error beyond this share of the range, or a correlation beyond this, asks for a profile.
_WIDE = 0.1
_CORRELATED = 0.98
# A minimum this much higher in chi-square is three standard errors away.
_RIVAL_RISE = 9.0
# A search along a profile that ends by so much in chi-square below the minimum has found a lower one.
_LOWER = 1e-3
# The sizes that a solution asks for are at rest after one refinement, unless it moves far.
_MOST_REFINEMENTS = 2


@dataclasses.dataclass(frozen=True)
class FitOptions:
    """Choices of a fit.

    Parameters
    ----------
    method
        ``gradient``, or ``simplex`` as the baseline.
    objective
        ``chi_square``, ``absolute``, ``relative`` or ``logarithmic``.
    n_starts
        Number of starts of the gradient fit: the sample's own, and random ones.
    scan
        Whether to scan a free parameter along which the misfit has many minima (the particle radius), and to
        start from the lowest ones instead of the sample's own start.
    seed
        Of the random starts.
    profile
        ``auto``: for parameters that the covariance shows to be weak; ``all``; or ``none``.
    accuracy
        Largest relative error of the BSDF that the discretisation may cause. Sizes are chosen for it at the
        start, and again at the solution, from where the fit goes on if that asks for larger ones.
    layer_method
        As of `SolverConfig`.
    config
        Sizes of the discretisation, instead of those for the accuracy.
    """

    method: str = "gradient"
    objective: str = "chi_square"
    n_starts: int = 1
    scan: bool = True
    seed: int = 0
    profile: str = "auto"
    accuracy: float = DEFAULT_ACCURACY
    layer_method: str = "fastest"
    config: SolverConfig | None = None

    def __post_init__(self):
        for name, allowed in (
            ("method", ("gradient", "simplex")),
            ("objective", OBJECTIVES),
            ("profile", ("auto", "all", "none")),
            ("layer_method", ("fastest", *LAYER_METHODS)),
        ):
            require_one_of(name, getattr(self, name), allowed)
        require_accuracy(self.accuracy)
        require_integer("n_starts", self.n_starts, 1, 10_000)
        require_integer("seed", self.seed, 0)
        if self.config is not None:
            require_kind("config", self.config, SolverConfig)


Progress = Callable[[str, int, float], None]


def fit(
    data: GonioData | str | Path,
    sample: Sample | str | Path,
    options: FitOptions | None = None,
    progress: Progress | None = None,
) -> FitResult:
    """Find the free parameters of a sample from a measurement.

    Works in 64 bits whatever the session's setting, and leaves that setting as it was.

    Parameters
    ----------
    data
        Measurement, or the file to read it from.
    sample
        Sample, or its file.
    options
        Choices; None for the defaults.
    progress
        Called with what is done, the step and the loss.

    Raises
    ------
    InputRefusedError
        If data or sample cannot be used.
    """
    options = FitOptions() if options is None else options
    require_kind("options", options, FitOptions)
    data, sample = read_inputs(data, sample)
    data = prepare_data(data, sample)
    release_programs()
    with computing():
        return _fit(data, sample, options, progress or _quiet)


def _quiet(what: str, step: int, loss: float) -> None:
    _LOG.debug("%s: step %d, loss %.6g", what, step, loss)


def read_inputs(data: GonioData | str | Path, sample: Sample | str | Path) -> tuple[GonioData, Sample]:
    """A measurement and a sample, each given itself or as its file.

    Parameters
    ----------
    data
        Measurement, or its file.
    sample
        Sample, or its file.

    Returns
    -------
    GonioData, Sample

    Raises
    ------
    InputRefusedError
        If one is neither, cannot be read, or a value of the sample is outside its range.
    ForkedProcessError
        In a process that was forked off one that had computed.
    """
    refuse_in_fork()
    require_kind("data", data, GonioData, str, Path)
    require_kind("sample", sample, Sample, str, Path)
    sample = sample if isinstance(sample, Sample) else load_sample(sample)
    sample.parameters.require_ranges()
    return read(data) if isinstance(data, str | Path) else data, sample


def prepare_data(data: GonioData, sample: Sample) -> GonioData:
    """The rows and masks that a sample asks for.

    Parameters
    ----------
    data
        The measurement.
    sample
        Names wavelengths and masks.

    Raises
    ------
    InputRefusedError
        If a wavelength of the sample is not in the data.
    """
    if sample.wavelengths_nm:
        known = np.unique(data.wavelength_nm)
        for wavelength in sample.wavelengths_nm:
            if not np.any(np.abs(known - wavelength) < 1e-6):
                raise InputRefusedError(
                    f"the sample names {wavelength:g} nm, but {data.source or 'the measurement'} holds "
                    f"{', '.join(f'{w:g}' for w in known)} nm only."
                )
        data = data.select(wavelength_nm=sample.wavelengths_nm)
    return data.with_masks(_limits(sample))


def marked(data: GonioData, sample: Sample) -> GonioData:
    """A measurement with the masks that a sample asks for, all rows kept, be none of them used.

    Parameters
    ----------
    data
        The measurement.
    sample
        Names masks.
    """
    return data.replace(mask=mask_bits(data, _limits(sample)))


def _limits(sample: Sample) -> MaskLimits:
    limits = dict(sample.masks)
    return MaskLimits(
        **{key: value or None for key, value in limits.items() if key != "grazing_theta_o_deg"},
        grazing_theta_o_deg=limits.get("grazing_theta_o_deg"),
    )


def _fit(data: GonioData, sample: Sample, options: FitOptions, progress: Progress) -> FitResult:
    noise = noise_of(data, sample)
    if options.objective == "chi_square" and not noise.known:
        raise InputRefusedError(
            f"{data.source or 'the measurement'}: its noise is not known ({noise.origin}) Declare it in "
            "[noise] of the sample file, or choose another objective."
        )
    objective = make_objective(
        data, sample, options.objective, options.config, noise, options.accuracy, options.layer_method
    )
    engine, searches, further = _search(objective, sample, options, progress)
    best = _lowest(searches, sample)
    for _ in range(_MOST_REFINEMENTS):
        config = _larger_sizes(objective, best, options)
        if config is None:
            break
        objective = make_objective(data, sample, options.objective, config, noise)
        engine, refined = _search_on(objective, best.unit, options, progress)
        searches.append(refined)
        best = _lowest([refined], sample)
    profiles: list[Profile] = []
    spread = _covariance(best) if options.objective == "chi_square" else None
    if engine is not None and spread is not None and options.profile != "none":
        best, spread, profiles, along = _profiles(engine, best, spread, options.profile, searches, progress)
        further = (*further, *along)
    return _assemble(data, sample, options, noise, objective, best, spread, searches, profiles, further)


def _larger_sizes(objective: Objective, best: Search, options: FitOptions) -> SolverConfig | None:
    """Sizes that the solution asks for, where they exceed those it was found with."""
    if options.config is not None:
        return None
    used = objective.model.config
    values = {n: float(v) for n, v in objective.values(jnp.asarray(best.unit)).items()}
    asked = used.at_least(objective.model.sizes(values, options.accuracy, options.layer_method))
    return None if asked == used else asked


def _search(objective, sample, options, progress):
    """Search from several starts: the gradient engine if any, the searches, and the scan, if any, as one."""
    free = sample.parameters.free
    first = objective.scale.to_unit(np.array([p.value for p in free]))
    if options.method == "simplex":
        return None, [SimplexSearch(objective).run(first, _named(progress, "simplex"))], ()
    engine, scans = GradientSearch(objective), ()
    points = starts(first, options.n_starts, options.seed)
    rugged = [i for i, p in enumerate(free) if p.multimodal]
    if rugged and options.scan:
        more, whole = scan(engine, first, rugged[0], _named(progress, "scan"))
        points, scans = more + points[1:], (whole,)
    searches = [
        engine.run(start, progress=_named(progress, f"start {i + 1}")) for i, start in enumerate(points)
    ]
    return engine, searches, scans


def _search_on(objective, unit, options, progress):
    """Go on from what was found with smaller sizes."""
    if options.method == "simplex":
        return None, SimplexSearch(objective).run(unit, _named(progress, "simplex"))
    engine = GradientSearch(objective)
    return engine, engine.run(unit, progress=_named(progress, "refinement"))


def _lowest(searches, sample) -> Search:
    best = min(searches, key=lambda s: s.loss if np.isfinite(s.loss) else np.inf)
    if not np.isfinite(best.loss):
        raise InputRefusedError(
            "the model is not finite at the start values: "
            + ", ".join(f"{p.name} = {p.value:g}" for p in sample.parameters.free)
            + "; start elsewhere."
        )
    return best


def _named(progress: Progress, what: str) -> Callable[[int, float], None]:
    return lambda step, loss: progress(what, step, loss)


def _covariance(best: Search) -> Covariance | None:
    if best.triangle is None:
        return None
    return covariance(best.triangle, best.unit, best.gradient)


def _profiles(engine, best, spread, which, searches, progress):
    """Profiles of the weak parameters; starts again where one of them finds a lower minimum.

    The best search, its covariance, the profiles, and all searches along them as one.
    """
    along: list[Search] = []
    for _ in range(3):
        profiles = []
        for position in range(len(best.unit)):
            if which == "all" or _is_weak(spread, position):
                progress("profile", position + 1, best.loss)
                profiles.append(profile(engine, best, position, spread.deviation[position]))
        here = [search for one in profiles for search in one.searches]
        along += here
        lower = [search for search in here if search.loss < best.loss - _LOWER]
        if not lower:
            break
        start = min(lower, key=lambda s: s.loss)
        improved = engine.run(start.unit)
        searches.append(improved)
        if improved.loss >= best.loss:
            break
        best, spread = improved, _covariance(improved)
    return best, spread, profiles, (together("profile", along, best),) if along else ()


def _is_weak(spread: Covariance, position: int) -> bool:
    deviation = spread.deviation[position]
    if spread.held[position] or not np.isfinite(deviation) or deviation > _WIDE:
        return True
    others = np.delete(spread.correlation[position], position)
    return bool(np.any(np.abs(others[np.isfinite(others)]) > _CORRELATED))


def _assemble(data, sample, options, noise, objective, best, spread, searches, profiles, further):
    free = sample.parameters.free
    first = objective.scale.to_unit(np.array([p.value for p in free]))
    values = {n: float(v) for n, v in objective.values(jnp.asarray(best.unit)).items()}
    fitted_sample = dataclasses.replace(sample, parameters=_with_values(sample.parameters, values))
    whitened = _whitened(objective, noise, best.predicted)
    parameters = _parameters(sample, objective, best, spread, profiles)
    known = spread is not None
    names = tuple(p.name for p in free) if known else ()
    return FitResult(
        sample=fitted_sample,
        data=data,
        predicted_per_sr=best.predicted,
        sigma_per_sr=np.asarray(noise.sigma_per_sr),
        whitened=whitened,
        method=options.method,
        objective=options.objective,
        outcome=best.outcome,
        parameters=parameters,
        correlation_names=names,
        correlations=spread.correlation if known else np.zeros((0, 0)),
        derived=_derived(objective, best, spread),
        merit=merit(data, best.predicted, whitened, len(free)),
        scans=merit_by_scan(data, best.predicted, whitened),
        noise={
            "origin": noise.origin,
            "scan_relative": noise.scan_relative,
            "known": noise.known,
        },
        searches=tuple(_summary(s, objective) for s in (*searches, *further)),
        profiles=tuple(
            ProfileCurve(
                free[p.position].name,
                tuple(_physical(objective, p.position, u, best) for u in p.unit),
                tuple(float(r) for r in p.rise),
            )
            for p in profiles
        ),
        solver=dataclasses.asdict(objective.model.config)
        | {"layer_method": layer_method(objective.model.config.layer_method)},
        versions={name: version(name) for name in _PACKAGES},
        seed=options.seed,
        notes=tuple(data.notes)
        + _notes(options, spread, best, first)
        + _rivals(objective, best, searches, spread),
    )


def _with_values(table, values):
    for name, value in values.items():
        table = table.replace(name, value=value)
    return table


def _whitened(objective: Objective, noise: FitNoise, predicted) -> np.ndarray | None:
    if not noise.known:
        return None
    return np.asarray(objective.in_noise(predicted, objective.measured - predicted))


def _physical(objective: Objective, position: int, unit: float, best: Search) -> float:
    variables = np.array(best.unit)
    variables[position] = unit
    return float(objective.scale.to_physical(variables)[position])


def _parameters(sample, objective, best, spread, profiles):
    values = sample.parameters.values_with(
        {n: float(v) for n, v in objective.values(jnp.asarray(best.unit)).items()}
    )
    slope = objective.scale.slope(best.unit)
    by_position = {p.position: p for p in profiles}
    rows = []
    for name, parameter in sample.parameters.items():
        start = sample.parameters.values_with({})[name]
        row = FittedParameter(
            name,
            parameter.unit,
            float(values[name]),
            None,
            float(start),
            parameter.minimum,
            parameter.maximum,
            parameter.free,
            parameter.tie,
        )
        if parameter.free:
            position = objective.free.index(name)
            row = _judged(row, position, objective, best, spread, slope, by_position.get(position))
        rows.append(row)
    return tuple(rows)


def _judged(row, position, objective, best, spread, slope, curve):
    """Standard error, bound and profile of one free parameter."""
    unit = best.unit[position]
    flag = "at lower bound" if unit <= 0 else "at upper bound" if unit >= 1 else ""
    # The unit variable of a one-minus scale grows with the parameter too: bounds keep their names.
    error = None
    if spread is not None and not spread.held[position]:
        deviation = spread.deviation[position] * abs(slope[position])
        error = float(deviation) if np.isfinite(deviation) else None
    interval = None
    if curve is not None:
        ends = [_physical(objective, position, u, best) for u in (curve.lower, curve.upper)]
        interval = (min(ends), max(ends))
        if not flag:
            flag = {
                (True, True): "not determined",
                (True, False): "open below",
                (False, True): "open above",
                (False, False): "",
            }[curve.open_below, curve.open_above]
    elif error is None and not flag and spread is not None:
        flag = "not determined"
    return dataclasses.replace(row, standard_error=error, flag=flag, interval=interval)


@eqx.filter_jit
def _coefficients(objective: Objective, unit):
    def of(u):
        return objective.model.coefficients(objective.values(u))

    return of(unit), jax.jacfwd(of)(unit)


_QUANTITIES = (
    "scattering_per_mm",
    "absorption_per_mm",
    "asymmetry_parameter",
    "reduced_scattering_per_mm",
    "reduced_optical_thickness",
)


def _derived(objective: Objective, best: Search, spread: Covariance | None):
    values, slopes = _coefficients(objective, jnp.asarray(best.unit))
    rows = []
    for layer, coefficients in values.items():
        for i, wavelength in enumerate(objective.model.wavelengths_nm):
            for quantity in _QUANTITIES:
                value = float(getattr(coefficients, quantity)[i])
                if not np.isfinite(value):
                    continue
                slope = np.asarray(getattr(slopes[layer], quantity)[i])
                rows.append(DerivedQuantity(layer, wavelength, quantity, value, _propagated(slope, spread)))
    return tuple(rows)


def _propagated(slope: np.ndarray, spread: Covariance | None) -> float | None:
    """Standard error of a function of the parameters."""
    if spread is None:
        return None
    matters = np.abs(slope) > 1e-12 * (np.max(np.abs(slope)) + 1e-300)
    block = spread.matrix[np.ix_(matters, matters)]
    if not np.all(np.isfinite(block)):
        return None
    return float(np.sqrt(max(slope[matters] @ block @ slope[matters], 0.0)))


def _summary(search: Search, objective: Objective) -> SearchSummary:
    def physical(unit):
        return {n: float(v) for n, v in objective.values(jnp.asarray(unit)).items()}

    return SearchSummary(
        search.method,
        search.outcome.name.lower(),
        physical(search.start),
        physical(search.unit),
        search.loss_start,
        search.loss,
        search.jacobians,
        search.evaluations,
        search.run_seconds,
        search.compile_seconds,
    )


def _notes(options: FitOptions, spread, best: Search, first: np.ndarray) -> tuple[str, ...]:
    notes = []
    if spread is None and options.method == "simplex":
        notes.append("The simplex has no Jacobian: no standard errors.")
    elif spread is None:
        notes.append(f"The objective '{options.objective}' is not chi-square: no standard errors are given.")
    # A search that goes on from another's end, and stays there, has moved all the same.
    if np.allclose(best.unit, first):
        notes.append("No parameter moved from its start value.")
    return tuple(notes)


def _rivals(objective: Objective, best: Search, searches, spread) -> tuple[str, ...]:
    """Other minima that the data can hardly tell from the best one."""
    if spread is None:
        return ()
    notes, told = [], [best.unit]
    reach = 3 * np.where(np.isfinite(spread.deviation), spread.deviation, 1.0) + 1e-3
    for search in sorted(searches, key=lambda s: s.loss):
        if not search.loss < best.loss + _RIVAL_RISE:
            break
        if all(np.any(np.abs(search.unit - unit) > reach) for unit in told):
            told.append(search.unit)
            at = ", ".join(
                f"{n} = {float(v):.5g}" for n, v in objective.values(jnp.asarray(search.unit)).items()
            )
            notes.append(
                f"Another minimum lies only {search.loss - best.loss:.2g} higher in chi-square, at {at}; "
                "these data hardly decide between the two."
            )
    return tuple(notes)


def predict(
    sample: Sample | str | Path,
    data: GonioData | str | Path,
    config: SolverConfig | None = None,
    accuracy: float = DEFAULT_ACCURACY,
) -> np.ndarray:
    """Predict the BSDF of a sample, without a fit, at every point of a measurement.

    Masks and the wavelengths that the sample names say what a fit takes; a prediction leaves nothing out.
    `jaxink.fitting.marked` masks what the sample's file masks, all points kept.

    Parameters
    ----------
    sample
        Sample, or its file.
    data
        Measurement, or its file; only its directions, sides and wavelengths are used. At a wavelength that
        the sample does not name, its parameters must hold, too; one given by wavelength needs a value there.
    config
        Sizes of the discretisation; None: those for the accuracy.
    accuracy
        Largest relative error of the BSDF that the discretisation may cause.

    Returns
    -------
    np.ndarray
        1/sr, shape ``(points,)``, in the order of the measurement.

    Raises
    ------
    InputRefusedError
        If sample or data cannot be used.
    """
    data, sample = read_inputs(data, sample)
    return evaluate(ForwardModel(sample, *data.directions, config, accuracy))
