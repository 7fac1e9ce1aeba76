"""The part of render.md on the size of printed dots, and its figure."""

import itertools
import textwrap

import numpy as np
from matplotlib.figure import Figure

from benchmarks.pages import REPOSITORY, table
from benchmarks.validation.render.dot_size import (
    DIFFUSE,
    FITTED,
    GUIDED,
    INKS,
    KEPT_ASIDE,
    LIGHTS,
    RATIOS,
    THICKNESSES,
    edge,
    fitted,
    ink,
    key,
    wide_layer,
)
from jaxink.export.dot_size import sheet_error
from jaxink.render.batches import Estimate

FIGURE = REPOSITORY / "docs" / "validation" / "render-dot-size.png"
_NAMES = {"thin_ink": "pale", "coloured_dot": "coloured", "white_dot": "white"}
_COLOURS = {"thin_ink": "tab:blue", "coloured_dot": "tab:red", "white_dot": "black"}
_PLATE, _AIR = 0, 1
_SIDES = {_PLATE: "into the plate", _AIR: "into air"}
# Below this diameter over thickness at 1 %, a relative error of the rule does not matter.
_SMALL = 10.0


def dot_size_section(found: dict) -> str:
    """Text with the numbers of `benchmarks.validation.render.dot_size`."""
    _figure(found).savefig(FIGURE, dpi=110, metadata={"Software": None})
    constants = fitted(found)
    errors = [
        [f"`{name}`", light, f"{ratio:g}", *_shown(found[key(name, light, 1.0, ratio)]["error"])]
        for name, light in itertools.product(INKS, LIGHTS)
        for ratio in RATIOS
    ]
    rows = [_row(found, *case) for case in itertools.product(INKS, THICKNESSES)]
    judged = [*_judged(found, FITTED, "fitted"), *_judged(found, (KEPT_ASIDE,), "kept aside")]
    heads = ["ink", "thickness, um", "optical thickness", "reduced"]
    heads += [f"{where}, {what}" for where in _SIDES.values() for what in (DIFFUSE, "rule", GUIDED)]
    inverse = f"""Errors are inverse to the diameter: {_law(found)}. So one number tells all sizes,
        the diameter over thickness at which the error is 1 %. A sheet returns too much and sends too
        little into air. The error into air is relative to what a sheet transmits, so that opaque inks
        need large dots for it; without absorption, both are the same power. Diameter over thickness where
        the sheet errs by 1 %:"""
    rule = f"""± is one standard error. **The rule** that `jaxink export` states takes the rim as an
        absorber: what leaves through it follows from the mean way of light in the ink and its reduced
        optical thickness, and what would have become of it from the derivatives of both totals by the
        absorption coefficient, which the solver knows (`export/dot_size.py`). Its form was found with
        fewer paths in Henyey-Greenstein inks of albedo 0.9 to 1; its three constants were fitted to
        {_words(FITTED)} in diffuse light, `{KEPT_ASIDE}` taking no part (some of its results were known
        when the form was chosen): f = {constants.leak:.3f}, u =
        {constants.upwards:.3f}, c = {constants.scatterings:.2f}. The diameter by the rule, in diffuse
        light, is wrong by:"""
    limits = f"""{_guided(found)} The export makes the statement for one scattering layer with smooth
        faces between plate and air, with optical thickness 1.5 to 40, albedo above 0.92, g of 0.5 to 0.85
        and indices of 1.45 to 1.6, about what was tried here."""
    return f"""## The size of a dot

![Error of a sheet by the diameter of the dot](render-dot-size.png)

From which diameter on is a sheet enough? One round dot of ink on a plate, in light that arrives in the plate,
uniform over the dot's footprint: from all directions alike (diffuse), or at 60 degrees (guided). What is
scattered back into the plate and what is scattered into air, through all faces of the dot, is compared with
the same of a sheet. The rim faces air; a part of what leaves through it enters the plate beside the dot and
counts as returned. Regular light is left out. By `python -m benchmarks.validation.render.dot_size`, the same
paths in double precision as above: from where a path first meets the rim it goes on twice, in a layer
without a rim and in the dot. Inks: `thin_ink` (g 0.6, albedo 0.989), `coloured_dot` (g 0.8, albedo 0.929) and
`white_dot` (spheres of rutile without absorption, g 0.64, in a binder of index 1.54 on a plate of 1.49).

Error of the sheet, its light over that of the volume less 1, at the thickness of the file:

{table(["ink", "light", "diameter / thickness", "into the plate, %", "into air, %"], errors)}

{_filled(inverse)}

{table(heads, rows)}

{_filled(rule)}

{table(["inks", "light", "where it is above 10 thicknesses, rms", "at most", "elsewhere"], judged)}

{_filled(limits)}"""


def _filled(text: str) -> str:
    """A paragraph in lines of even length."""
    return textwrap.fill(" ".join(text.split()), 110)


def _shown(one: dict) -> list[str]:
    values, errors = (100 * np.array(one[part]) for part in ("value", "standard_error"))
    return [f"{v:+.2f} ± {e:.2f}" for v, e in zip(values, errors, strict=True)]


def _at_one_percent(found: dict, name: str, light: str, thickness: float) -> Estimate:
    """Diameter over thickness at 1 %, for plate and air, by the paths."""
    seen = edge(found, name, light, thickness)
    return Estimate(100 * np.abs(seen.value), 100 * seen.error)


def _by_rule(name: str, thickness: float) -> np.ndarray:
    """The same by the rule, in diffuse light."""
    return 100 * np.abs(sheet_error(wide_layer(name, DIFFUSE, thickness)))


def _row(found: dict, name: str, thickness: float) -> list[str]:
    medium, layer = ink(name, thickness), wide_layer(name, DIFFUSE, thickness)
    optical = float(medium.extinction_per_mm[0]) * medium.thickness_um / 1000
    head = [f"`{name}`", f"{medium.thickness_um:g}", f"{optical:.3g}", f"{layer.reduced_thickness:.3g}"]
    both = [_at_one_percent(found, name, light, thickness) for light in (DIFFUSE, GUIDED)]
    rule = _by_rule(name, thickness)
    for side in _SIDES:
        diffuse, guided = (f"{one.value[side]:.1f} ± {one.error[side]:.1f}" for one in both)
        head += [diffuse, f"{rule[side]:.1f}", guided]
    return head


def _law(found: dict) -> str:
    """How far error times diameter is constant."""
    cases = list(itertools.product(INKS, LIGHTS, THICKNESSES))
    squares, smallest = [], []
    for case in cases:
        mean = edge(found, *case)
        each = [found[key(*case, ratio)]["edge"] for ratio in RATIOS]
        values, errors = (np.array([one[part] for one in each]) for part in ("value", "standard_error"))
        squares.append(np.sum(((values - mean.value) / errors)[1:] ** 2))
        is_large = mean.value**2 > 0.1**2
        smallest += (values[0] / mean.value)[is_large].tolist()
    chi2 = np.sum(squares) / (2 * len(cases) * (len(RATIOS) - 2))
    return (
        f"from {RATIOS[1]} to {RATIOS[-1]} thicknesses, the difference over the light of the sheet, times "
        f"the diameter, is constant with a reduced chi-square of {chi2:.2f} over the {len(cases)} series of "
        f"three inks in four thicknesses and two lights, and at {RATIOS[0]} thicknesses it is "
        f"{np.mean(smallest):.2f} of that in the mean"
    )


def _words(names: tuple[str, ...]) -> str:
    return " and ".join(f"`{name}`" for name in names)


def _judged(found: dict, names: tuple[str, ...], what: str) -> list[list[str]]:
    """Error of the rule at the diameter where a sheet errs by 1 %, in a row for each side."""
    rows = []
    for side, where in _SIDES.items():
        relative, small = [], [0.0]
        for name, thickness in itertools.product(names, THICKNESSES):
            seen = _at_one_percent(found, name, DIFFUSE, thickness).value[side]
            rule = _by_rule(name, thickness)[side]
            if seen >= _SMALL:
                relative.append(100 * (rule / seen - 1))
            else:
                small.append(abs(rule - seen))
        rms, most = np.sqrt(np.mean(np.square(relative))), np.max(np.abs(relative))
        elsewhere = f"{max(small):.1f} thicknesses" if max(small) else ""
        rows.append([f"{_words(names)} ({what})", where, f"{rms:.0f} %", f"{most:.0f} %", elsewhere])
    return rows


def _guided(found: dict) -> str:
    """How much larger dots must be in guided light."""
    ratios = []
    for case in itertools.product(INKS, THICKNESSES):
        diffuse, guided = (
            _at_one_percent(found, case[0], light, case[1]).value for light in (DIFFUSE, GUIDED)
        )
        ratios.append(np.where(diffuse >= _SMALL, guided / diffuse, np.nan))
    low, high = np.nanmin(ratios, axis=0), np.nanmax(ratios, axis=0)
    return (
        f"Light at 60 degrees goes further sideways: it needs dots {low[_PLATE]:.2f} to {high[_PLATE]:.2f} "
        f"times as large for the plate, and {low[_AIR]:.2f} to {high[_AIR]:.2f} times for air."
    )


def _figure(found: dict) -> Figure:
    """Errors by diameter at the thickness of the files, and the rule."""
    figure = Figure(figsize=(8.4, 3.6), layout="constrained")
    ratios = np.array(RATIOS, float)
    for side, axes in enumerate(figure.subplots(1, 2)):
        for name, (light, marker) in itertools.product(INKS, zip(LIGHTS, "os", strict=True)):
            cases = [found[key(name, light, 1.0, ratio)]["error"] for ratio in RATIOS]
            value, error = (
                100 * np.array([case[part][side] for case in cases]) for part in ("value", "standard_error")
            )
            axes.errorbar(
                ratios,
                np.abs(value),
                error,
                fmt=marker,
                markersize=4,
                color=_COLOURS[name],
                mfc=_COLOURS[name] if light == DIFFUSE else "none",
                label=f"{_NAMES[name]}, {light}",
            )
        for name in INKS:
            share = _by_rule(name, 1.0)[side] / 100 / ratios * (1 if side == _PLATE else -1)
            axes.loglog(ratios, 100 * np.abs(share / (1 - share)), color=_COLOURS[name], lw=0.8)
        axes.axhline(1.0, color="grey", lw=0.6)
        axes.set(title=f"light {_SIDES[side]}", xlabel="diameter / thickness", ylim=(0.05, 60))
        axes.set_xticks(RATIOS, [f"{ratio:g}" for ratio in RATIOS], minor=False)
        axes.minorticks_off()
    figure.axes[0].set_ylabel("|error of the sheet|, %\n(lines: rule, diffuse)")
    figure.axes[0].legend(fontsize=7)
    return figure
