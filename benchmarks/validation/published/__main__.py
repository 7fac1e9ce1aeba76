"""Write published-protocols.md and its figures from the fits that are kept, and make those that are not.

python -m benchmarks.validation.published [--kept]
"""

import sys
from pathlib import Path

import numpy as np

from benchmarks.pages import filled, machine, page_path, table, write_page
from benchmarks.validation.published import boundary, boundary_page, fits, one_sheet, profiles, relief
from benchmarks.validation.published.conclusions import inside_percent, numbers, side_percent
from benchmarks.validation.published.figures import draw
from benchmarks.validation.published.fits import kept, made
from benchmarks.validation.published.judgement import truth_values
from benchmarks.validation.published.problems import (
    COLOURED,
    EVERYTHING,
    NAMES,
    PROTOCOL,
    ROUGH,
    SHEET,
    WEIGHTED,
    WHITE,
    WITH_R,
    WITH_T_45,
    measured,
)
from benchmarks.validation.published.spectral_shape import (
    diffuse_reflectance,
    shape_of_absorption_index,
    shape_of_scattering,
)
from benchmarks.validation.published_tables import inks

TITLES = {
    WHITE: "Sample 1, white with smooth faces: `white_ink_mie`",
    ROUGH: "Sample 2, white with a rough outer face: `white_ink_rough`",
    COLOURED: "Sample 3, coloured: `coloured_ink`",
    SHEET: "The sheet of 2018: `sheet_2018`",
}
MODELS = {"mie": "Mie", "hg": "Henyey–Greenstein"}
# Names of parameters for people, with units.
_WORDS = {
    "radius_nm": ("radius", "nm"),
    "volume_fraction": ("volume fraction", ""),
    "particle_index": ("n", ""),
    "particle_absorption_index": ("k", ""),
    "sigma_deg": ("sigma", "deg"),
    "thickness_um": ("thickness", "um"),
    "scattering_per_mm": ("mu_s", "/mm"),
    "absorption_per_mm": ("mu_a", "/mm"),
    "asymmetry_parameter": ("g", ""),
}
_SCANS = {
    WHITE: {PROTOCOL: "T at 0, absolute RMSD (published)", WEIGHTED: "T at 0"},
    COLOURED: {
        PROTOCOL: "R, published shape, relative RMSD of logarithms (published)",
        WEIGHTED: "R, published shape",
        EVERYTHING: "R, free at each wavelength",
    },
    SHEET: {
        PROTOCOL: "R and T at 0, both faces lit, relative RMSD (published)",
        WEIGHTED: "R and T at 0, both faces lit",
        EVERYTHING: "R and T at 0 to 60, both faces lit",
    },
}
_SCANS[WHITE] |= {WITH_R: "T and R at 0", WITH_T_45: "T at 0 and 45", EVERYTHING: "R and T at 0 to 60"}
_SCANS[ROUGH] = _SCANS[WHITE]
_MOST_LISTED = 6


def _percent(value: float) -> str:
    return f"{value:+.0f}" if abs(value) >= 9.5 else f"{value:+.2g}"


def _inside(found: dict, *components: str) -> str:
    """Root mean square and largest error of some components, in per cent."""
    largest = max((e["largest_percent"] for e in found["inside"] if e["component"] in components), key=abs)
    rms = inside_percent(found, *components)
    return f"{f'{rms:.0f}' if rms >= 9.5 else f'{rms:.2g}'} ({_percent(largest)})"


def _word(key: str) -> tuple[str, str]:
    """Word and unit of a parameter."""
    stem, _, wavelength = key.rpartition(".")[2].partition("@")
    word, unit = _WORDS[stem]
    return word + (f" at {wavelength}" if wavelength else ""), unit


def _parameters(name: str, found: dict) -> str:
    """Fitted values with standard errors, and how far spheres are from the truth."""
    truth = truth_values(name) if name.endswith("-mie") else {}
    parts = []
    for key, p in found["parameters"].items():
        word, unit = _word(key)
        error = "" if p["standard_error"] is None else f" ± {p['standard_error']:.2g}"
        off = f", {_percent(100 * (p['value'] / truth[key] - 1))} %" if key in truth else ""
        unknown = found["kind"] == "chi_square" and p["standard_error"] is None
        flag = p["flag"] or ("not determined" if unknown else "")
        flag = f", {flag}" if flag else ""
        parts.append(f"{word} {p['value']:.4g}{error}{' ' + unit if unit else ''}{off}{flag}")
    more = len(parts) - _MOST_LISTED
    return "; ".join(parts[:_MOST_LISTED]) + (f"; and {more} more" if more > 0 else "")


def _loss(found: dict) -> str:
    """What was minimised, at what was found : at what it should not miss."""
    pair = [found["loss"], found.get("loss_at_reference")]
    kind = found["kind"]
    if kind == "chi_square":
        shown = [f"{x:.1f}" for x in pair if x is not None]
        return f"{' : '.join(shown)} / {found['points']}"
    if kind == "absolute":
        return " : ".join(f"{100 * np.pi * x:.3f} % of pi f" for x in pair if x is not None)
    return " : ".join(f"{100 * x:.2f} %" for x in pair if x is not None)


def _side(found: dict, side: str) -> str:
    value = side_percent(found, side)
    return "" if value is None else f"{value:.2f}"


def _ended(found: dict) -> str:
    return found["outcome"].split(":")[0 if found["converged"] else 1].strip()


def _effort(found: dict) -> list[str]:
    return [
        str(found["effort"]["jacobians"]),
        f"{found['effort']['run_seconds']:.1f}",
        f"{found['seconds']:.0f}",
    ]


def fits_table(name: str) -> str:
    """All fits of one reconstruction."""
    ink, model = name.split("-")
    known = "at the truth" if model == "mie" else "at the fit of everything"
    header = ["fitted to", f"minimised, found : {known}", "ended"]
    header += ["parameters, with their distance from the truth" if model == "mie" else "parameters"]
    header += ["R, rms %", "T, rms %", "inside: R_II, %", "T_IA, T_AI, %", "R_AA, %"]
    header += ["Jacobians", "seconds of the search", "in all"]
    rows = []
    for scans in made(name):
        found = kept(name, scans)
        cells = [_SCANS[ink][scans], _loss(found), _ended(found), _parameters(name, found)]
        cells += [_side(found, side) for side in "RT"]
        cells += [_inside(found, "R_II"), _inside(found, "T_IA", "T_AI"), _inside(found, "R_AA")]
        rows.append([*cells, *_effort(found)])
    return table(header, rows)


def weakest(name: str) -> str:
    """What the scans of the protocol determine least, in words."""
    if WEIGHTED not in made(name):
        return ""
    along = kept(name, WEIGHTED)["weakest"]
    held = [k for k, p in kept(name, WEIGHTED)["parameters"].items() if p["standard_error"] is None]
    if not along:
        return ""
    words = [
        f"{_WORDS[key.rpartition('.')[2].partition('@')[0]][0]} {_percent(100 * change)} %"
        for key, change in along.items()
    ]
    apart = ""
    if held:
        names = ", ".join(_WORDS[key.rpartition(".")[2].partition("@")[0]][0] for key in held)
        apart = f" Without a standard error, at a bound or not determined: {names}."
    return (
        "Together by one standard error, along the combination that the published scans determine least, "
        f"go {', '.join(words)}.{apart}"
    )


def section(name: str) -> str:
    """Text on one reconstruction."""
    model = name.split("-")[1]
    path = page_path(f"published-{name}.png")
    draw(name, path)
    return f"""### {MODELS[model]}

{fits_table(name)}

{weakest(name)}

![{name}: measured and modelled BSDF at all incidences]({path.name})
"""


def overview() -> str:
    """The published figure of merit beside that of the same protocol here."""
    printed = {ink.name: ink for ink in inks()}
    sample_of = {WHITE: "1", ROUGH: "2", COLOURED: "3"}
    rows = []
    for name in _complete():
        ink, model = name.split("-")
        if ink == SHEET:
            published = "4.5"
        else:
            one = printed[sample_of[ink]]
            published = (one.spheres if model == "mie" else one.lobe)["rmsd_percent"]
        by_protocol, everything = kept(name, PROTOCOL), kept(name, EVERYTHING)
        rows.append(
            [
                f"`{name}`",
                f"{published} % (not public)",
                _loss(by_protocol),
                _ended(by_protocol),
                *(f"{_side(f, side)}" for f in (by_protocol, everything) for side in "RT"),
                *(_inside(f, "R_II", "T_IA", "T_AI", "R_AA") for f in (by_protocol, everything)),
            ]
        )
    header = [
        "reconstruction",
        "published RMSD",
        "RMSD here, found : at the truth (Mie) or at the fit of everything (HG)",
        "ended",
    ]
    header += [f"{side} {how}, rms %" for how in ("by the protocol", "by all") for side in "RT"]
    header += [f"inside, {how}, %" for how in ("by the protocol", "by all")]
    return table(header, rows)


def shapes() -> str:
    """The published shapes of the coloured ink, and the true one."""
    (data,) = measured(COLOURED)
    true = truth_values(f"{COLOURED}-mie")
    k = np.array([v for key, v in true.items() if "@" in key])
    reflectance = diffuse_reflectance(data)
    columns = zip(
        reflectance.items(),
        k / k.mean(),
        shape_of_absorption_index(data),
        shape_of_scattering(data),
        strict=True,
    )
    rows = [[f"{nm:g}", f"{r:.3f}", f"{t:.2f}", f"{a:.2f}", f"{s:.2f}"] for (nm, r), t, a, s in columns]
    header = ["wavelength, nm", "K_d", "k over its mean, true", "published shape of k", "of the scattering"]
    return table(header, rows)


def _complete() -> list[str]:
    """Reconstructions with the fit by the protocol and that of everything."""
    return [name for name in NAMES if {PROTOCOL, EVERYTHING} <= {*made(name)}]


def main() -> None:
    """Make what is missing, and write the page; with --kept, write it from what is kept."""
    if "--kept" not in sys.argv[1:]:
        fits.make_missing(NAMES)
    inks_done = dict.fromkeys(name.split("-")[0] for name in NAMES)
    sections = {
        ink: "\n".join(section(name) for name in _complete() if name.startswith(ink)) for ink in inks_done
    }
    seconds = sum(kept(name, scans)["seconds"] for name in NAMES for scans in made(name))
    write_page(
        "published-protocols.md",
        filled(
            Path(__file__).with_name("protocols.md.in"),
            machine=machine(),
            seconds=seconds,
            overview=overview(),
            shapes=shapes(),
            one_sheet=one_sheet.text(),
            relief=relief.make(),
            relief_picture=relief.picture().name,
            profiles=profiles.text(_word),
            lower_minima=profiles.lower_minima(),
            profiles_seconds=profiles.seconds(),
            boundary=boundary_page.text(),
            boundary_picture=boundary_page.picture().name,
            boundary_seconds=boundary_page.seconds(),
            joining=f"{boundary_page.joining_percent():.1g}",
            photons=boundary.N_PHOTONS,
            **numbers(),
            **{ink: f"## {TITLES[ink]}\n\n{text}" for ink, text in sections.items()},
        ),
    )


if __name__ == "__main__":
    main()
