"""Write interface.json: one rough interface by Monte Carlo, a reference for the tests.

python -m benchmarks.montecarlo.reference [--rays N] [--out FILE]
"""

import argparse
import json
from pathlib import Path

import numpy as np

from benchmarks.montecarlo.facets import Facets
from benchmarks.montecarlo.interface import INTERFACE_FILE, interface_alone

CONVENTION = (
    "Simulated by benchmarks.montecarlo.reference. One interface alone between n_from and n_to, lit from "
    "n_from at theta_i_deg in that medium, unpolarised. t: scale of the slopes; densities and walk: "
    "docstring of facets.py. R (back into n_from) and T (into n_to) are shares of the incident power "
    "after all facet events, *_single after exactly one, *_events after 1, 2, 3, 4, 5, 6, 7 or more. "
    "*_bsdf_per_sr: radiance over irradiance without cosine, mean over azimuth and over the ring between "
    "ring_edges_deg of the outgoing angle in the medium of exit, weighted by cos(theta) dOmega: power in "
    "the ring / (pi (sin^2 edge2 - sin^2 edge1)). *_se: standard error, 20 batches."
)
CASES = (
    ("cauchy", np.tan(np.deg2rad(3.2))),
    ("beckmann", np.tan(np.deg2rad(5.0))),
    ("beckmann", np.tan(np.deg2rad(20.0))),
    ("ggx", np.tan(np.deg2rad(10.0))),
)
# A case with a total above the share and a relative error above the limit is simulated again with more rays.
RELATIVE_ERROR, SMALL_SHARE = 1e-3, 0.01
INCIDENCES = {(1.0, 1.5): (0, 30, 60, 80), (1.5, 1.0): (0, 20, 40, 50, 70)}


def reference(n_rays: int, seed: int = 1) -> dict:
    """All cases of the reference file."""

    def short(x):
        return np.vectorize(lambda v: float(f"{v:.6g}"))(x).tolist()

    rows = []
    for kind, scale in CASES:
        facets = Facets(kind, scale)
        for indices, angles in INCIDENCES.items():
            for theta in angles:
                n = n_rays
                result = interface_alone(indices, theta, facets, n, seed)
                worst = max(result[k][1] / result[k][0] for k in "RT" if result[k][0] > SMALL_SHARE)
                if worst > RELATIVE_ERROR:
                    n = int(1.2 * n * (worst / RELATIVE_ERROR) ** 2)
                    result = interface_alone(indices, theta, facets, n, seed)
                row = {"density": kind, "t": scale, "n_from": indices[0], "n_to": indices[1]}
                row |= {"theta_i_deg": theta, "n_rays": n}
                for name, (value, error) in result.items():
                    name = name.replace("bsdf", "bsdf_per_sr")
                    row |= {name: short(value), f"{name}_se": short(error)}
                rows.append(row)
    edges = np.linspace(0, 90, 19).tolist()
    return {"convention": CONVENTION, "seed": seed, "ring_edges_deg": edges, "cases": rows}


def main():
    """Write the reference file."""
    parser = argparse.ArgumentParser(description="Reference of one rough interface by Monte Carlo.")
    parser.add_argument("--rays", type=int, default=4_000_000, help="incident rays of a case")
    parser.add_argument("--out", type=Path, default=INTERFACE_FILE)
    arguments = parser.parse_args()
    result = reference(arguments.rays)
    lines = ",\n".join(json.dumps(row) for row in result.pop("cases"))
    head = json.dumps(result)[:-1]
    temporary = arguments.out.with_suffix(".tmp")
    temporary.write_text(f'{head}, "cases": [\n{lines}\n]}}\n', encoding="utf-8")
    temporary.replace(arguments.out)


if __name__ == "__main__":
    main()
