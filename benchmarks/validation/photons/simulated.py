"""The Monte Carlo against the simulated measurements, which come from another program."""

import csv
from dataclasses import dataclass, field

import miepython
import numpy as np

from benchmarks.montecarlo import Detectors, Layer, Result, Sample, Tabulated, simulate
from benchmarks.simulated_data import data_file, truth_of
from benchmarks.validation.photons.cases import HG, PLATE, facets
from benchmarks.validation.photons.solving import with_error


@dataclass(frozen=True)
class Simulated:
    """One incidence of a simulated measurement, and what is true of its sample beside the ink."""

    name: str
    theta_deg: float
    plate: Layer = PLATE
    between: tuple[Layer, ...] = ()
    options: dict = field(default_factory=dict)

    @property
    def backing(self):
        """Albedo of the backing, None without."""
        return self.options.get("backing_albedo")


SIMULATED = (
    Simulated("plain_hg", 30.0),
    Simulated("index_step_hg", 45.0, Layer(1.49, 2.0)),
    Simulated("white_ink_rough", 0.0, options={"faces": (None, None, facets("cauchy", 3.2))}),
    Simulated("white_ink_rough", 60.0, options={"faces": (None, None, facets("cauchy", 3.2))}),
    Simulated("undeclared_air_gap", 15.0, between=(Layer(1.0, 0.01),)),
    Simulated("undeclared_backing", 30.0, options={"backing_albedo": 0.2}),
    Simulated("undeclared_lateral_loss", 0.0, options={"beam_radius_mm": 1.0, "seen_radius_mm": 2.0}),
    Simulated("undeclared_lateral_loss", 60.0, options={"beam_radius_mm": 1.0, "seen_radius_mm": 2.0}),
)


def simulated_phase(ink: dict, wavelength_nm: float):
    """Phase function of a simulated ink."""
    phase = ink["phase"]
    if phase["type"] == "hg":
        return HG(phase["g"])
    cosines = np.cos(np.linspace(0, np.pi, 2001))
    size = 2 * np.pi * phase["radius_nm"] * ink["n"] / wavelength_nm
    index = complex(phase["n_re"], -phase["n_im"]) / ink["n"]
    return Tabulated(cosines, miepython.i_unpolarized(index, size, cosines))


def compare_simulated(case: Simulated, n_photons: int, seed: int) -> list[str]:
    """Row of the Monte Carlo against the noise-free values and totals of a simulated measurement."""
    truth = truth_of(case.name)
    with data_file(case.name).open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    ink, optics = truth["ink"], truth["optics"][0]
    phase = simulated_phase(ink, optics["wavelength_nm"])
    printed = Layer(ink["n"], ink["d_mm"], optics["mus"], optics["mua"], phase)
    sample = Sample((case.plate, *case.between, printed), **case.options)
    own = [n for n, row in enumerate(rows) if float(row["theta_i_deg"]) == case.theta_deg]
    chosen = [n for n in own if case.backing is None or rows[n]["side"] == "R"][::6]
    columns = (np.array([float(rows[n][c]) for n in chosen]) for c in ("theta_o_deg", "phi_deg"))
    seen = Detectors(*columns, np.array([rows[n]["side"] == "T" for n in chosen]))
    lateral = sample.seen_radius_mm is not None
    result = simulate(sample, case.theta_deg, n_photons, seed, None if lateral else seen)

    (totals,) = (
        t for t in truth["totals"] if t["theta_i"] == case.theta_deg and t["backing_albedo"] == case.backing
    )
    names = {"R": "R_diffuse", "T": "T_diffuse", "A": "absorbed", "lost": "lost", "backing": "backing"}
    cells = []
    for theirs, ours in names.items():
        power = result.powers[ours]
        shown = f"{totals[theirs]:.4f} : {with_error(*Result.mean_and_error(power), 4)}"
        cells.append(shown if power.any() else "")
    if lateral:
        return [f"`{case.name}`", f"{case.theta_deg:.0f}", *cells, "", "", ""]
    value, error = Result.mean_and_error(result.bsdf)
    known, its_error = (np.array(truth[key])[chosen] for key in ("noise_free", "monte_carlo_se"))
    deviations = (value - known) / np.hypot(error, its_error)
    statistics = [str(value.size), f"{np.mean(deviations**2):.2f}", f"{np.max(np.abs(deviations)):.1f}"]
    return [f"`{case.name}`", f"{case.theta_deg:.0f}", *cells, *statistics]
