"""Samples that both follow light through, and their kinds."""

import numpy as np

from benchmarks import montecarlo
from benchmarks.montecarlo import Facets, Layer, Sample

HG = montecarlo.HenyeyGreenstein
PLATE = Layer(1.5, 1.0)


def facets(kind: str, sigma_deg: float) -> Facets:
    """Facets by the angle that sample files give."""
    return Facets(kind, np.tan(np.deg2rad(sigma_deg)))


CASES = {
    "ink on the exit face of a plate": Sample((PLATE, Layer(1.5, 0.08, 95.0, 1.1, HG(0.6)))),
    "ink on the entry face": Sample((Layer(1.5, 0.08, 95.0, 1.1, HG(0.6)), PLATE)),
    "index step, 1.49 to 1.56": Sample((Layer(1.49, 2.0), Layer(1.56, 0.08, 85.0, 0.9, HG(0.55)))),
    "opaque ink behind a plate": Sample((PLATE, Layer(1.5, np.inf, 120.0, 4.0, HG(0.7)))),
    "free film, g = 0.85": Sample((Layer(1.5, 0.05, 80.0, 0.4, HG(0.85)),)),
    "absorbing plate, water behind": Sample(
        (Layer(1.52, 3.0, 0.0, 0.05), Layer(1.45, 0.05, 60.0, 1.0, HG(0.3))), index_back=1.33
    ),
    "two inks, one with two lobes": Sample(
        (Layer(1.5, 0.03, 100.0, 0.2, HG(0.8, -0.3, shares=(0.7, 0.3))), Layer(1.6, 0.05, 20.0, 3.0, HG(0.4)))
    ),
    "rough ink on the exit face": Sample(
        (PLATE, Layer(1.5, 0.08, 95.0, 1.1, HG(0.6))), faces=(None, None, facets("cauchy", 3.2))
    ),
    "rough ink on the entry face": Sample(
        (Layer(1.5, 0.08, 95.0, 1.1, HG(0.6)), PLATE), faces=(facets("ggx", 10), None, None)
    ),
    "thin rough ink on the exit face, 1.49 to 1.56": Sample(
        (Layer(1.49, 2.0), Layer(1.56, 0.03, 60.0, 0.5, HG(0.5))), faces=(None, None, facets("beckmann", 8))
    ),
    "thin rough ink on the entry face": Sample(
        (Layer(1.56, 0.03, 60.0, 0.5, HG(0.5)), Layer(1.49, 2.0)), faces=(facets("beckmann", 8), None, None)
    ),
}

# Kinds of cases by words in their names; the first that fits counts.
KINDS = (
    ("rough face, lit from inside the sample", ("rough", "exit face")),
    ("rough face, lit from outside", ("rough", "entry face")),
    ("smooth", ()),
)


def kind_of(name: str) -> str:
    """Kind of a case."""
    return next(kind for kind, words in KINDS if all(word in name for word in words))
