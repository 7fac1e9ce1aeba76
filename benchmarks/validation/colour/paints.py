"""Real oil paints over a black and a white card: pigments fitted to tints, shades predicted.

python -m benchmarks.validation.colour.paints

Fitted are films of eight pigments and of zinc white, of their mixtures with zinc white, and of zinc white
with bone black; predicted are the pigments with bone black, over both cards, without any free number. Nobody
states the thickness of a film: all are taken to be equal, and to be the unit of length. Shares are by mass,
so that coefficients are those of a mass.
"""

import csv
import json
import time
from pathlib import Path

import jax
import numpy as np
from scipy.optimize import least_squares

import jaxink
from benchmarks.pages import data_folder
from benchmarks.validation.colour.prints import errors
from jaxink.colour.kubelka_munk import saunderson
from jaxink.measurement import Readings
from jaxink.model.readings import ReadingsModel
from jaxink.numerics.precision import computing
from jaxink.projects import Measurement, Project

RESULTS = Path(__file__).with_name("paints.json")
SET = "paint_vangogh_black_white"
WHITE, BLACK = "ZincWhite", "BoneBlack"
# Those without organic dyes that were mixed with white as well as with black, by the number of their samples.
PIGMENTS = ("05", "06", "09", "10", "11", "12", "14", "15")
_OF_WHITE = ("07A", "07C", "07D", "07F")
# Two films of a pair are not identical: within so much, and the cards were read as differing by less.
FLOOR, RELATIVE = 0.01, 0.01
INDEX, _STEP_NM = 1.48, 20.0
_LITTLE = 0.03
_INKS = ("pigment", "white", "black")
_FREE = "{ per_wavelength = true, free = true, value = VALUE, min = MIN, max = 1e4 }"
_SCATTERING = _FREE.replace("VALUE", "20").replace("MIN", "1e-2")
_ABSORPTION = _FREE.replace("VALUE", "1").replace("MIN", "1e-4")
_OF_INK = "[inks.{}]\nscattering_per_mm = {}\nabsorption_per_mm = {}\n"
_FILM = f"""
schema_version = 1
wavelength_nm = WAVES
{"".join(_OF_INK.format(ink, _SCATTERING, _ABSORPTION) for ink in _INKS)}
[[layers]]
name = "film"
kind = "scattering"
phase_function = "henyey_greenstein"
asymmetry_parameter = 0.6
refractive_index = {INDEX}
thickness_um = 1000
mixture = {{ pigment = 0, white = 0, black = 0 }}
[backing]
contact = true
reflectance = {{ per_wavelength = true, value = 0.5 }}
"""


class Paints:
    """The set: components of each film by mass, and spectra over both cards."""

    def __init__(self, folder: Path):
        self.mixtures: dict[str, dict[str, float]] = {}
        with (folder / "samples.csv").open(encoding="utf-8") as file:
            for row in csv.DictReader(file):
                if (share := float(row["mass_percent"]) / 100) > 0:
                    self.mixtures.setdefault(row["sample"], {})[row["component"]] = share
        with (folder / "reflectance.csv").open(encoding="utf-8") as file:
            rows = [row for row in csv.DictReader(file) if float(row["wavelength_nm"]) % _STEP_NM == 0]
        self.waves = np.array(sorted({float(row["wavelength_nm"]) for row in rows}))
        self._rows = {name: [row for row in rows if row["sample"] == name] for name in self.mixtures}

    def spectra(self, name: str, card: str) -> tuple[np.ndarray, np.ndarray]:
        """Reflectance of a film over a card, and of the card beside it."""
        keys = f"r_paint_over_{card}", f"r_card_{card}"
        over, bare = (np.array([float(row[key]) for row in self._rows[name]]) for key in keys)
        return over, bare

    def pigment(self, name: str) -> str:
        """What is neither zinc white nor bone black in a film; the first pigment if there is nothing else."""
        others = [one for one in self.mixtures[name] if one not in (WHITE, BLACK)]
        return others[0] if others else next(iter(self.mixtures[f"{PIGMENTS[0]}A"]))

    def values(self, name: str, card: str) -> dict[str, float]:
        """Shares of a film and reflectance of its card, by the names of parameters."""
        of_ink = dict(zip(_INKS, (self.pigment(name), WHITE, BLACK), strict=True))
        shares = {f"film.mixture.{ink}": self.mixtures[name].get(c, 0.0) for ink, c in of_ink.items()}
        behind = in_contact(self.spectra(name, card)[1])
        return shares | {
            f"backing.reflectance@{w:g}": float(r) for w, r in zip(self.waves, behind, strict=True)
        }

    def name_of(self, parameter: str, name: str) -> str:
        """What a parameter of the pigment is called among those of all pigments."""
        ink, dot, rest = parameter.partition(".")
        return f"{self.pigment(name)}{dot}{rest}" if ink == _INKS[0] else parameter

    def chosen(self, letters: str) -> list[str]:
        """Films of the pigments, by what they are mixed with."""
        return [f"{p}{letter}" for p in PIGMENTS for letter in letters if f"{p}{letter}" in self.mixtures]


def in_contact(reflectance: np.ndarray) -> np.ndarray:
    """Reflectance of a card that a film wets, from that in air: both have a face of the binder's index."""
    outside, inside = (float(one[0]) for one in saunderson(np.array([INDEX])))
    own = reflectance - outside
    return np.clip(own / ((1 - outside) * (1 - inside) + inside * own), 0, 1)


def readings(paints: Paints, name: str, card: str) -> Readings:
    """What was read of a film on a card."""
    values, waves = paints.spectra(name, card)[0], paints.waves
    angles = (np.full(len(waves), one) for one in (np.nan, 8.0, np.nan))
    quantity = np.array(["R_di_8"] * len(waves))
    return Readings(quantity, *angles, waves, values, RELATIVE * values + FLOOR)


def measurement(paints: Paints, film: jaxink.Sample, name: str, card: str) -> Measurement:
    """One film over one card, as part of a project."""
    own = f"s{name}_{card}"
    names = {
        n: f"{own}/{n}" if n.startswith(("film.", "backing.")) else paints.name_of(n, name)
        for n in film.parameters
    }
    return Measurement(own, readings(paints, name, card), film.replace(paints.values(name, card)), names)


def predicted(paints: Paints, film: jaxink.Sample, names: list[str], found: dict[str, float]) -> np.ndarray:
    """Reflectances over the black and the white card."""
    model = ReadingsModel(film, readings(paints, names[0], "black"))
    rows = []
    with computing():
        bsdf = jax.jit(model.bsdf)
        for name in names:
            inks = {p.name: found[paints.name_of(p.name, name)] for p in film.parameters.free}
            rows += [bsdf(inks | paints.values(name, card)) for card in ("black", "white")]
    return np.array(rows)


def by_two_constants(paints: Paints, names: list[str], is_fitted: np.ndarray, number: int) -> np.ndarray:
    """The same at one wavelength by Kubelka and Munk's film on a card, with Saunderson's correction."""
    outside, inside = (float(one[0]) for one in saunderson(np.array([INDEX])))
    pigments = list(dict.fromkeys(c for name in names for c in paints.mixtures[name]))
    pairs = [(name, card) for name in names for card in ("black", "white")]
    shares = np.array([[paints.mixtures[name].get(c, 0.0) for c in pigments] for name, _ in pairs])
    cards = np.array([in_contact(paints.spectra(*pair)[1])[number] for pair in pairs])
    values = np.array([paints.spectra(*pair)[0][number] for pair in pairs])

    def reflectance(x: np.ndarray) -> np.ndarray:
        scattering, absorption = (shares @ one for one in np.exp(x).reshape(2, -1))
        a = 1 + absorption / scattering
        b = np.sqrt(a**2 - 1)
        coth = b / np.tanh(b * scattering)
        layer = (1 - cards * (a - coth)) / (a - cards + coth)
        return outside + (1 - outside) * (1 - inside) * layer / (1 - inside * layer)

    def residual(x: np.ndarray) -> np.ndarray:
        return ((reflectance(x) - values) / (RELATIVE * values + FLOOR))[is_fitted]

    start = np.log([10.0] * len(pigments) + [1.0] * len(pigments))
    return reflectance(least_squares(residual, start, bounds=(np.log(1e-4), np.log(1e4))).x)


def main() -> None:
    """Fit, predict, and keep the errors."""
    folder = data_folder("measured") / SET
    paints = Paints(folder)
    film = jaxink.parse_sample(_FILM.replace("WAVES", str(paints.waves.tolist())))
    tints = [name for name in paints.chosen("BC") if WHITE in paints.mixtures[name]]
    fitted, shades = [*_OF_WHITE, *paints.chosen("A"), *tints], paints.chosen("DE")
    measurements = [measurement(paints, film, name, card) for name in fitted for card in ("black", "white")]
    began = time.perf_counter()
    result = jaxink.fit(Project(tuple(measurements)), options=jaxink.FitOptions(profile="none"))
    seconds = time.perf_counter() - began
    found = {name: row.value for name, row in result.parameters.items()}
    names = [*fitted, *shades]
    values = np.array([paints.spectra(name, card)[0] for name in names for card in ("black", "white")])
    of_row = np.repeat(names, 2)
    black = np.array([paints.mixtures[name].get(BLACK, 0.0) for name in of_row])
    is_shade = np.isin(of_row, shades)
    kinds = {
        "fitted: pure, and with white": ~is_shade,
        "with 1 % of black": is_shade & (black < _LITTLE),
        "with 5 to 11 % of black": is_shade & (black >= _LITTLE),
    }
    two = [by_two_constants(paints, names, ~is_shade, number) for number in range(len(paints.waves))]
    kept = {
        "seconds": seconds,
        "wavelengths": len(paints.waves),
        "parameters": len(result.parameters.free),
        "converged": result.converged,
        "reduced_chi_square": result.reduced_chi_square,
        "jaxink": errors(predicted(paints, film, names, found), values, paints.waves, kinds),
        "two constants": errors(np.stack(two, axis=1), values, paints.waves, kinds),
    }
    RESULTS.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
