"""Write docs/validation/colour.md from the results kept beside this file.

python -m benchmarks.validation.colour
"""

import json
from pathlib import Path

from benchmarks.pages import REPOSITORY, filled, table
from benchmarks.validation.colour.coloured_ink import RESULTS as COLOURED
from benchmarks.validation.colour.coverage import RESULTS as COVERAGE
from benchmarks.validation.colour.named import CASES
from benchmarks.validation.colour.named import RESULTS as NAMED
from benchmarks.validation.colour.outside import RESULTS as OUTSIDE
from benchmarks.validation.colour.paints import FLOOR as PAINTS_FLOOR
from benchmarks.validation.colour.paints import RELATIVE as PAINTS_RELATIVE
from benchmarks.validation.colour.paints import RESULTS as PAINTS
from benchmarks.validation.colour.pigments import RESULTS as PIGMENTS
from benchmarks.validation.colour.pigments_montecarlo import RESULTS as PIGMENTS_MONTECARLO
from benchmarks.validation.colour.prints import FLOOR, RELATIVE
from benchmarks.validation.colour.prints import RESULTS as PRINTS
from jaxink.numerics.digits import with_uncertainty

# Not by `page_path`: the manual has a page of that name.
PAGE = REPOSITORY / "docs" / "validation" / "colour.md"
_TEMPLATE = Path(__file__).parent / "colour.md.in"
_MODELS = {"mie": "spheres", "hg": "Henyey–Greenstein"}
_LUMINANCE, _XY = 0.003, 0.0005
_NUMBERS = ("X", "Y", "Z", "x", "y", "L", "a", "b")
_PIGMENTS = """
## Two pigments

Anatase and iron oxide red by name in one binder on a plate, {wavelengths} wavelengths from 400 to 700 nm,
{points} values with noise of 0.5 % in reflection and transmission at two incidences. The values come from the
forward model at an accuracy of 1e-5, ten times that of the fits (called so: they test fits and colours, not
the model). CIEDE2000 for D65 and 2 degrees: of the measured directions, and in the last columns
of the free ink in contact with a card, seen at 45:0, predicted against the true ink.

{rows}

{found}
"""

_SIMULATED = """
### By the Monte Carlo

Three of these wavelengths by this repository's Monte Carlo
(`python -m benchmarks.validation.colour.pigments_montecarlo`), with the cross sections and phase functions of
miepython added over both kinds of spheres, {photons} photons per incidence and wavelength. The forward model
at the true concentrations against it; the error of the Monte Carlo is largely common to the directions of an
incidence:

{rows}

Fitted to the simulated values with the same noise, the concentrations are {found} (true are 0.08 and 0.02),
at a reduced chi-square of {reduced}.
"""
_NAMED = """
## Spectra of an ink that is declared otherwise

`python -m benchmarks.validation.colour.named`: five wavelengths from 450 to 650 nm, two incidences,
reflection and transmission with noise of 0.5 %, from the forward model (called so: these cases test names,
not the model). The diagnosis has a sample file that lacks what was simulated, or names another pigment; a
wrong pigment is a mistake in the input, found by one refit for each material that is known at all
wavelengths.

{rows}
"""
_PRINTS = """
## Real prints, mixed from five inks

`python -m benchmarks.validation.colour.prints`: spectra at 45:0 of 35 opaque prints of cyan, magenta,
yellow, black and white inks in steps of 25 % (the repository YanniZhangYZ/gaussian-fabrication on GitHub;
the measurements are not copied here). The inks are fitted to the five pure prints and the mixtures of two
with 75 % of one, all {wavelengths} wavelengths together: one [project](../manual/projects.md) of {fitted}
prints, [mixed](../manual/sample-file.md#mixed-inks) from inks with {parameters} free parameters, in
{seconds} s. The ten prints of two halves are predicted. Nobody states the noise: {relative:g} % of the
reading and {floor:g} are taken, and the reduced chi-square is {reduced:.2f}. CIEDE2000 is for D65 and 2
degrees. For comparison, the two constants of Kubelka and Munk of each ink, fitted to the same readings with
the same weights and Saunderson's correction:

{rows}

The asymmetry parameter that all inks share is {asymmetry:.2f}, at its lower bound. Particles that scatter
backwards brighten dark prints at 45:0, and so does a face that is not smooth; opaque prints at one geometry
cannot tell which. Both ways add the coefficients of the inks, and predict alike.
"""
_PAINTS = """
## Real paints over cards

`python -m benchmarks.validation.colour.paints`: reconstructed oil paints over a black and a white card
(Geldof et al. 2018, Heritage Science 6:17; the repository fligt/revigo-spectra on GitHub; not copied here),
eight pigments at {wavelengths} wavelengths, 8:di. The fit has the films of the pure pigments, of their
tints with zinc white, and of zinc white with bone black, {parameters} free coefficients, in {seconds} s;
their shades with bone black are predicted over both cards, with no free number. Nobody states the thickness
of the films; all are taken to be equal. The noise is taken as {relative:g} % and {floor:g}, the distance of
two films of a pair, with which the reduced chi-square is {reduced:.2f}. For comparison, films of Kubelka
and Munk on the same cards:

{rows}

Both ways leave nearly the same errors, which points to what both assume: equal thicknesses, coefficients in
proportion to the mass of a pigment whatever else is in the film, and the same smooth face on all films (some
reflect less than a smooth face of oil does).
"""


def read(path: Path) -> dict | None:
    """Kept results, if there are some."""
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def fits(kept: dict) -> list[tuple[str, str, dict]]:
    """Model, way and results of each fit."""
    return [
        (_MODELS[model], way, kept[f"{model}-{way}"])
        for model in _MODELS
        for way in ("published", "free")
        if f"{model}-{way}" in kept
    ]


def coloured(kept: dict) -> str:
    """Errors of the four fits."""
    heads = ["ink", "way", "luminance factor, rms (largest), %", "x, y, rms (largest)"]
    heads += ["CIEDE2000 to the truth", "to the measurement", "of the noise alone", "verdict", "seconds"]
    rows = []
    for model, way, one in fits(kept):
        r = one["sides"]["R"]
        rows.append(
            [
                model,
                way,
                f"{100 * r['luminance_rms']:.2f} ({100 * r['luminance_largest']:.2f})",
                f"{r['xy_rms']:.5f} ({r['xy_largest']:.5f})",
                *(f"{r[f'ciede2000_{of}']:.2f}" for of in ("truth", "measured", "noise")),
                one["verdict"].replace("_", " "),
                f"{one['seconds']:.0f}",
            ]
        )
    return table(heads, rows)


def aims(kept: dict) -> str:
    """Which fits are within them."""
    words = []
    for model, way, one in fits(kept):
        r = one["sides"]["R"]
        rms = r["luminance_rms"] <= _LUMINANCE and r["xy_rms"] <= _XY
        every = r["luminance_largest"] <= _LUMINANCE and r["xy_largest"] <= _XY
        says = (
            "met in every direction" if every else "met in rms, not in every direction" if rms else "missed"
        )
        words.append(f"{model}, {way}: {says}")
    return "; ".join(words) + "."


def by_wavelength(kept: dict) -> str:
    """Error of each fit at each wavelength."""
    waves = fits(kept)[0][2]["wavelength_nm"]
    rows = [
        [model, way, *(f"{100 * value:.2f}" for value in one["sides"]["R"]["by_wavelength"])]
        for model, way, one in fits(kept)
    ]
    return table(["ink", "way", *(f"{wave:g} nm" for wave in waves)], rows)


def colours(kept: dict) -> str:
    """Colours of the free fits."""
    rows = []
    for model, _, one in fits(kept):
        for colour in one.get("colours", []):
            errors = colour["standard_errors"] or dict.fromkeys(_NUMBERS)
            shown = [with_uncertainty(colour[name], errors[name]) for name in _NUMBERS]
            rows.append([model, colour["name"], *shown])
    return table(["ink", "geometry", *_NUMBERS], rows)


def outside(kept: dict) -> str:
    """Errors at the predicted wavelengths."""
    waves = list(next(iter(kept["models"].values())))
    rows = [
        [_MODELS[model], *(f"{100 * one[w]['rms']:.1f} ({100 * one[w]['mean']:+.1f}) %" for w in waves)]
        for model, one in kept["models"].items()
    ]
    return table(["ink", *(f"{wave} nm" for wave in waves)], rows)


def pigments(kept: dict | None) -> str:
    """The section on two pigments."""
    if kept is None or not kept["ways"]:
        return ""
    places = list(next(iter(kept["ways"].values()))["predicted"])
    heads = ["fit", "parameters", "reduced chi-square", "seconds", "measured against fitted, R / T"]
    rows = []
    for way, one in kept["ways"].items():
        sides = one["measured_against_fitted"]
        rows.append(
            [
                way,
                str(one["parameters"]),
                f"{one['reduced_chi_square']:.3g}",
                f"{one['seconds']:.0f}",
                " / ".join(f"{side['mean']:.2f}" for side in sides.values()),
                *(f"{one['predicted'][place]:.2f}" for place in places),
            ]
        )
    found = []
    if "pigments" in kept["ways"]:
        one = kept["ways"]["pigments"]
        each = (f"{n} {with_uncertainty(v, one['errors'][n])}" for n, v in one["values"].items())
        found.append(f"Concentrations by the pigment fit: {', '.join(each)}; true are 0.08 and 0.02.")
    draws = read(COVERAGE) or []
    if draws:
        inside = (
            f"{name} {sum(abs(draw['distances'][name]) <= 1 for draw in draws)}"
            for name in draws[0]["distances"]
        )
        found.append(
            f"Of {len(draws)} draws of the noise, the pigment fit is within one standard error of the truth "
            f"in (68 % are expected; two parameters determine all numbers): {', '.join(inside)}."
        )
    return _PIGMENTS.format(
        wavelengths=kept["wavelengths"],
        points=kept["points"],
        rows=table(
            [*heads, *(f"{place.replace(' over ', ' of the thickness, card of ')}" for place in places)], rows
        ),
        found=" ".join(found),
    )


def pigments_simulated(kept: dict | None) -> str:
    """The section on two pigments by the Monte Carlo."""
    if kept is None:
        return ""
    sides = [
        [
            place,
            f"{100 * one['rms']:.2f}",
            f"{100 * one['mean']:+.2f}",
            f"{100 * one['error_of_monte_carlo']:.2f}",
        ]
        for place, one in kept["model"].items()
    ]
    found = (f"`{n}` {with_uncertainty(v, kept['errors'][n])}" for n, v in kept["values"].items())
    return _SIMULATED.format(
        photons=f"{kept['photons']:g}",
        rows=table(
            ["side, nm", "model / simulated - 1, rms, %", "mean, %", "error of the Monte Carlo, %"], sides
        ),
        found=", ".join(found),
        reduced=f"{kept['reduced_chi_square']:.3g}",
    )


def named(kept: dict | None) -> str:
    """The section on causes that are named on spectra."""
    rows = [
        [
            name,
            f"`{one['code']}`",
            ", ".join(f"`{word}`" for word in one["named"]) or "-",
            " -> ".join(f"{value:.4g}" for value in one["reduced_chi_square"]),
            "yes" if one["named"] == [one["expected"]] else "no",
        ]
        for name in CASES
        if (one := (kept or {}).get(name))
    ]
    heads = ["simulated", "verdict", "named", "reduced chi-square", "right"]
    return _NAMED.format(rows=table(heads, rows)) if rows else ""


def both_ways(kept: dict, what: str) -> str:
    """Errors of predicted spectra and of their colours, beside those of two constants."""
    heads = [what, "number", "by", "rms of R", "relative rms, %", "CIEDE2000, mean (largest)"]
    rows = [
        [
            kind,
            str(one["spectra"]),
            by,
            f"{one['rms']:.4f}",
            f"{100 * one['relative_rms']:.1f}",
            f"{one['ciede2000_mean']:.2f} ({one['ciede2000_largest']:.1f})",
        ]
        for kind in kept["jaxink"]
        for by in ("jaxink", "two constants")
        if (one := kept[by][kind])
    ]
    return table(heads, rows)


def prints(kept: dict | None) -> str:
    """The section on real prints."""
    if kept is None:
        return ""
    return _PRINTS.format(
        wavelengths=kept["wavelengths"],
        fitted=next(iter(kept["jaxink"].values()))["spectra"],
        parameters=kept["parameters"],
        seconds=f"{kept['seconds']:.0f}",
        relative=100 * RELATIVE,
        floor=FLOOR,
        reduced=kept["reduced_chi_square"],
        rows=both_ways(kept, "prints"),
        asymmetry=kept["asymmetry"],
    )


def paints(kept: dict | None) -> str:
    """The section on real paints."""
    if kept is None:
        return ""
    return _PAINTS.format(
        wavelengths=kept["wavelengths"],
        parameters=kept["parameters"],
        seconds=f"{kept['seconds']:.0f}",
        relative=100 * PAINTS_RELATIVE,
        floor=PAINTS_FLOOR,
        reduced=kept["reduced_chi_square"],
        rows=both_ways(kept, "films"),
    )


def missing(kept: dict, kept_outside: dict, kept_pigments: dict | None, kept_named: dict | None) -> str:
    """What was asked for and is not here."""
    lines = [
        "The coverage of the error bars of free fits.",
        "Real prints or paints of which another thickness is predicted.",
        "Scattering coefficients of the sintered PTFE: an opaque sample tells its albedo, not lengths.",
    ]
    lines += [f"The diagnosis of: {name}." for name in CASES if name not in (kept_named or {})]
    done = set() if kept_pigments is None else set(kept_pigments["ways"])
    undone = [way for way in ("pigments", "published", "free") if way not in done]
    if undone:
        lines.append(f"The two-pigment ink: {', '.join(undone)} fit.")
    lines += [
        f"The coloured stand-in by {_MODELS[model]}, {way}."
        for model in _MODELS
        for way in ("published", "free")
        if f"{model}-{way}" not in kept
    ]
    if "hg" not in kept_outside["models"]:
        lines.append("Wavelengths outside the fit by Henyey–Greenstein.")
    return "\n".join(f"- {line}" for line in lines)


def main() -> None:
    """Write the page."""
    one, other, two, causes = read(COLOURED), read(OUTSIDE), read(PIGMENTS), read(NAMED)
    if one is None or other is None:
        raise SystemExit("run the modules coloured_ink and outside of benchmarks.validation.colour first.")
    first = fits(one)[0][2]
    errors = [r["errors"] for _, _, r in fits(one) if "errors" in r]
    relative = ", ".join(
        f"{100 * value:.1f} % at {wave} nm" for wave, value in other["monte_carlo_rel"].items()
    )
    PAGE.write_text(
        filled(
            _TEMPLATE,
            monte_carlo=f"{100 * one['monte_carlo_rel_se_median']:.2f}",
            light=first["light"],
            directions=first["sides"]["R"]["directions"],
            coloured=coloured(one),
            aims=aims(one),
            by_wavelength=by_wavelength(one),
            errors=" ".join(f"{text}." for text in dict.fromkeys(errors)),
            colours=colours(one),
            photons=other["photons"],
            outside_error=relative,
            outside=outside(other),
            pigments=pigments(two) + pigments_simulated(read(PIGMENTS_MONTECARLO)),
            named=named(causes) + prints(read(PRINTS)) + paints(read(PAINTS)),
            missing=missing(one, other, two, causes),
        ).rstrip()
        + "\n",
        encoding="utf-8",
    )
    print(f"written: {PAGE.relative_to(REPOSITORY)}")


if __name__ == "__main__":
    main()
