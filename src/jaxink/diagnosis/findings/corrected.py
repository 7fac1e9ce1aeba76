"""The corrected model: the declared sample with the effects found, fitted to the same measurement."""

import dataclasses

import numpy as np

from jaxink.diagnosis.search.loop import SearchResult
from jaxink.diagnosis.search.workbench import Solution, Workbench
from jaxink.effects import declare, settled
from jaxink.fitting import FitResult, fit
from jaxink.fitting.assembly import Found, assemble
from jaxink.fitting.endings import Ending
from jaxink.fitting.inputs import prepare_data
from jaxink.fitting.objective import Objective, make_objective
from jaxink.fitting.outcome import Search
from jaxink.fitting.uncertainty import covariance
from jaxink.measurement import noise_of
from jaxink.numerics.progress import Progress


def corrected_fit(found: SearchResult, follow: Progress) -> FitResult:
    """Fit of the corrected model, from the end of the search and at its resolution.

    It is that of the declared model if no effect was found. Otherwise the last fit of the search has fitted
    the same parameters of the same model already, in another order; nothing is compiled for it again.
    """
    if not found.last.accepted:
        return found.fit
    setup, solution = found.setup, found.last.solution
    sample = declare(setup.sample, found.last.accepted, solution.values)
    options = dataclasses.replace(
        found.options.fit, starts=1, scan=False, profile="none", config=setup.config
    )
    data = prepare_data(found.fit.data, sample)
    fixed = settled(sample, setup.scene, data.bsdf_per_sr[data.used]) if sample.effects else sample
    noise = noise_of(data, sample.noise)
    objective = make_objective(data, fixed, "chi_square", setup.config, noise)
    search, bench = _in_order_of(objective, solution, found.last.bench), found.last.bench
    if search is None:
        return fit(data, sample, options, follow)
    end = search.derivatives
    errors = covariance(end.triangle, search.unit, end.gradient).for_noise_of(noise.degrees_of_freedom)
    others = (_in_order_of(objective, rival, bench) for rival in found.rivals)
    endings = (Ending(search, is_start=True), *(Ending(other) for other in others if other is not None))
    ended = Found(search, errors, (search,), endings=endings, is_from_search=True)
    return assemble(data, fixed, options, noise, objective, ended)


def _in_order_of(objective: Objective, solution: Solution, bench: Workbench) -> Search | None:
    """A search with its variables in the order of an objective; None if they are not the same."""
    search, names = solution.search, solution.free
    if set(names) != set(objective.free):
        return None
    scale = bench.scale_of(objective.free)
    fields = (field.name for field in dataclasses.fields(scale))
    if not all(np.array_equal(getattr(scale, name), getattr(objective.scale, name)) for name in fields):
        return None
    order = [names.index(name) for name in objective.free]
    end = search.derivatives
    return dataclasses.replace(
        search,
        start=search.start[order],
        unit=search.unit[order],
        triangle=np.linalg.qr(end.triangle[:, order])[1],
        gradient=end.gradient[order],
        path=dataclasses.replace(search.path, unit=search.path.unit[:, order]),
    )
