"""Compare jaxink's forward model with the Monte Carlo of benchmarks/montecarlo and write monte-carlo.md.

python -m benchmarks.validation.photons
"""

from pathlib import Path

import jax
import numpy as np

from benchmarks.montecarlo import Result, simulate
from benchmarks.pages import filled, table, write_page
from benchmarks.validation.photons.cases import CASES, KINDS, kind_of
from benchmarks.validation.photons.simulated import SIMULATED, compare_simulated
from benchmarks.validation.photons.solving import (
    INCIDENCES_DEG,
    PHI_DEG,
    THETA_DEG,
    compare,
    directions,
    kind_row,
    solve,
)

N_PHOTONS = 160_000
CASE_HEADER = ["sample", "incidence, degrees"]
STATISTICS = ["directions", "mean square deviation", "largest deviation"]
POWER_HEADER = ["R regular", "T regular", "R diffuse", "T diffuse", "absorbed"]
SIMULATED_HEADER = ["measurement", "incidence, degrees", "R", "T", "absorbed", "lost", "backing", *STATISTICS]


def _listed(numbers) -> str:
    return ", ".join(f"{number:g}" for number in numbers)


def main() -> None:
    """Write the page."""
    jax.config.update("jax_enable_x64", True)
    bsdf_rows, total_rows, of_kind = [], [], {kind: [] for kind, _ in reversed(KINDS)}
    for seed, (name, sample) in enumerate(CASES.items(), 1):
        seen = directions(any(np.isinf(layer.thickness_mm) for layer in sample.layers))
        for theta_deg, *solved in zip(INCIDENCES_DEG, *solve(sample, seen), strict=True):
            result = simulate(sample, theta_deg, N_PHOTONS, 100 * seed + int(theta_deg), seen)
            cells, totals, deviations = compare(result, seen, *solved)
            bsdf_rows.append([name, f"{theta_deg:.0f}", *cells])
            total_rows.append([name, f"{theta_deg:.0f}", *totals])
            of_kind[kind_of(name)].append((deviations, solved[0] / Result.mean_and_error(result.bsdf)[0]))
        jax.clear_caches()
    simulated = [compare_simulated(case, N_PHOTONS // 2, seed) for seed, case in enumerate(SIMULATED, 1)]
    bsdf_header = ["directions", "mean standard error, relative", *STATISTICS[1:]]
    bsdf_header += ["mean ratio in R", "mean ratio in T"]
    kind_rows = [kind_row(*item) for item in of_kind.items()]
    text = filled(
        Path(__file__).with_name("monte-carlo.md.in"),
        photons=N_PHOTONS,
        simulated_photons=N_PHOTONS // 2,
        theta_deg=_listed(THETA_DEG),
        phi_deg=_listed(PHI_DEG),
        kinds=table(["samples", *STATISTICS, "jaxink over Monte Carlo there"], kind_rows),
        bsdf=table([*CASE_HEADER, *bsdf_header], bsdf_rows),
        totals=table([*CASE_HEADER, *POWER_HEADER], total_rows),
        simulated=table(SIMULATED_HEADER, simulated),
    )
    write_page("monte-carlo.md", text)


if __name__ == "__main__":
    main()
