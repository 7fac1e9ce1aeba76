"""The corrected model: the declared sample with the effects found, fitted to the same measurement."""

import dataclasses

from jaxink.diagnosis.search.loop import SearchResult
from jaxink.effects import declare
from jaxink.fitting import FitResult, fit
from jaxink.numerics.progress import Progress


def corrected_fit(found: SearchResult, follow: Progress) -> FitResult:
    """Fit of the corrected model, from the end of the search and at its resolution.

    It is that of the declared model if no effect was found.
    """
    if not found.last.accepted:
        return found.fit
    sample = declare(found.setup.sample, found.last.accepted, found.last.solution.values)
    options = dataclasses.replace(
        found.options.fit, n_starts=1, scan=False, profile="none", config=found.setup.config
    )
    return fit(found.fit.data, sample, options, follow)
