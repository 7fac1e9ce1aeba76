"""Fit samples measured as totals, not as a BSDF, and write docs/measured-totals.md.

python -m benchmarks.validation.totals
"""

import numpy as np

import jaxink
from benchmarks.pages import data_folder, machine, table, write_page
from benchmarks.validation.totals.discs import (
    ASYMMETRY,
    OTHER_ASYMMETRIES,
    PTFE,
    THICKNESS_SIGMA_MM,
    DiscFit,
    Discs,
    discs,
    fit_discs,
    predictor,
    rms,
)
from benchmarks.validation.totals.sphere import (
    LOSSES,
    N_PHOTONS,
    REFLECTANCE_ERROR,
    REFLECTANCES,
    SPHERE,
    SQUEEZED,
    Inferred,
    inferred,
    losses_in_slides,
    slabs,
)
from jaxink.numerics.precision import computing

MODELS = {
    "one slab, n = 1.35": (1.35, False),
    "one slab, no interface": (1.0, False),
    "discs with gaps, n = 1.35": (1.35, True),
}
BEFORE, AFTER = "one slab, n = 1.35", "discs with gaps, n = 1.35"
LEAST_PULL = 2.0
# Name, wavelengths and asymmetry parameter; None: the file's own.
SAMPLES = (
    ("tio2_phantom", (500.0, 633.0, 800.0), 0.6),
    ("phantom_510nm_series", (1055.6, 1253.0, 1604.7), None),
)
NO_LOSS, IN_SLIDES, IN_ALL = LOSSES


def refusal(folder: str, file: str, sample: str | None = None) -> str:
    """What `jaxink diagnose` tells a user who gives it such a file."""
    path = data_folder("measured") / folder / file
    try:
        jaxink.read(path, sample=sample)
    except jaxink.InputRefusedError as error:
        return str(error).replace(str(path), path.name)
    raise SystemExit(f"{path.name} was read as a BSDF; this page has to be written anew.")


def with_error(value: float, error: float, digits: int = 3) -> str:
    """A value and its standard error, if it has one."""
    return f"{value:.{digits}g}" + ("" if np.isnan(error) else f" ± {error:.2g}")


def discs_section() -> str:
    """Stacks of discs as one slab, and with the gaps between them."""
    data = discs()
    single, counts = data.made_of()
    own = THICKNESS_SIGMA_MM * np.eye(data.thickness_mm.size)
    noises = {"none": 0 * own, "of each stack": own, "of each kind of disc": THICKNESS_SIGMA_MM * counts}
    rows, fits, kind_fits, alone, deviances = [], {}, {}, {}, {}
    for name, (index, gaps) in MODELS.items():
        predict = predictor(data, index, gaps)
        found = {noise: fit_discs(predict, data, errors) for noise, errors in noises.items()}
        others = [fit_discs(predict, data, own, g).chi_square for g in OTHER_ASYMMETRIES]
        deviances[name] = np.array([fit.deviance for fit in found.values()])
        best = fits[name] = found["of each stack"]
        kind_fits[name] = found["of each kind of disc"]
        each = np.arange(data.thickness_mm.size)
        alone[name] = np.array([fit_discs(predict, data, own, used=each != k).deviation[k] for k in each])
        reduced, absorption = np.exp(best.parameters[0]), best.parameters[1]
        rows.append(
            [
                name,
                *(f"{fit.chi_square:.1f}" for fit in found.values()),
                ", ".join(f"{chi_square:.1f}" for chi_square in others),
                f"{rms(best.deviation):.3f}",
                f"{rms(alone[name]):.3f}",
                with_error(reduced, reduced * best.standard_errors[0]),
                with_error(absorption, best.standard_errors[1], 2),
                "absorption at lower bound" if best.at_bound else "none at a bound",
            ]
        )
    header = [
        "model",
        *(f"chi-square, thickness error {noise}" for noise in noises),
        f"as the second, g = {', '.join(f'{g:g}' for g in OTHER_ASYMMETRIES)}",
        "rms of ln T",
        "rms of ln T, stacks left out",
        "reduced scattering, 1/mm",
        "absorption, 1/mm",
        "flag",
    ]
    stacks = [
        [
            f"{thickness:g}",
            composition(single, made),
            *(" / ".join(f"{ratio:.3f}" for ratio in np.exp(fit.deviation[k])) for fit in fits.values()),
            *(f"{rms(deviation[k]):.3f}" for deviation in alone.values()),
        ]
        for k, (thickness, made) in enumerate(zip(data.thickness_mm, counts, strict=True))
    ]
    stack_header = ["thickness, mm", "discs, mm", *MODELS, *(f"left out: {name}" for name in MODELS)]
    before, after = fits[BEFORE], fits[AFTER]
    most = int(np.argmax(data.n_discs))
    n_scales, n_parameters = data.theta_deg.size, before.parameters.size
    freedom = data.transmitted.size - n_scales - n_parameters
    changes = deviances[AFTER] - deviances[BEFORE]
    by_kind = [fit.chi_square for fit in (kind_fits[BEFORE], kind_fits[AFTER])]
    sentence_of_kinds = (
        f"chi-square is {by_kind[0]:.1f} without the gaps and {by_kind[1]:.1f} with them: the thickness of "
        "the thin discs, wrong by as much in each, can stand in for the gaps."
        if max(by_kind) < 1.5 * freedom
        else f"chi-square is {by_kind[0]:.1f} without the gaps and {by_kind[1]:.1f} with them."
    )
    kinds = [
        f"{np.exp(after.deviation[k].mean()):.3f} ({composition(single, made)} mm)"
        for kind in range(single.size)
        for k, made in enumerate(counts)
        if made[kind] == made.sum()
    ]
    return f"""## Stacks of PTFE discs (`{PTFE[0]}`): transmittance against thickness

Simone Pasquini, University of Zurich, report of the Swiss Summer Student Particle Physics Program 2025,
table 2. Light of a blue LED that a detector right behind the disc receives, taken as hemispherical
transmittance; light that the detector reflects back is not modelled. The absolute scale of the data depends
on the angle of incidence (at {data.theta_deg[-1]:g} degrees T reaches {data.transmitted.max():.2f}), so each
angle has a free scale, and only the shape against thickness counts: {data.transmitted.size} values,
{n_scales} scales and {n_parameters} parameters, **{freedom} degrees of freedom**. R is not used.

Henyey-Greenstein with g = {ASYMMETRY:g} fixed. Reduced scattering and absorption are fitted to ln T, weighted
by the stated sigma ({100 * np.median(data.sigma / data.transmitted):.1f} % in the median).
Before: one slab of the whole thickness, with a smooth interface of index 1.35 or with none. After: as many
equal discs as were stacked, with air between them and no further parameter. Without an interface a gap
changes nothing, so the gaps are tried at n = 1.35 only.

The thickness is stated to ±{THICKNESS_SIGMA_MM:g} mm. Its effect on ln T, by the derivative of the model,
goes into the covariance in three ways: (1) not at all; (2) an independent error of each stack, which its
angles share; (3) an error of each kind of disc, which all stacks share that hold it. The numbers of discs
and the thicknesses allow one composition only, see the second table. Parameters, rms and all that follows are
those of (2).

{table(header, rows)}

T of the model over T measured, at {" / ".join(f"{theta:g}" for theta in data.theta_deg)} degrees. On the
right, the rms of ln T of a stack that was left out of the fit:

{table(stack_header, stacks)}

Under (2) the fit is **{"better" if after.chi_square < before.chi_square else "worse"}** with the gaps:
chi-square {before.chi_square:.1f} becomes {after.chi_square:.1f} with as many parameters. But the answer
depends on the errors of thickness that are allowed. The covariance differs between the models, too; with its
determinant, -2 ln(likelihood) changes by {", ".join(f"{change:+.1f}" for change in changes)}
under (1), (2) and (3) when the gaps are put in.
Under (3) {sentence_of_kinds}

The stack of
{data.n_discs[most]} discs ({data.thickness_mm[most]:g} mm) tells most: left out of the fit, it is missed by
{rms(alone[BEFORE][most]):.3f} in ln T as one slab, and by {rms(alone[AFTER][most]):.3f} as discs with gaps.

Chi-square with the gaps is still {after.chi_square / freedom:.1f} times the degrees of freedom. Points off by
more than {LEAST_PULL:g} standard deviations, of sigma and thickness together:

{points_left(data, fits)}

What is left with the gaps goes with the kind of disc. Model over measured, mean over the angles:
{", ".join(kinds)}. One and two discs of the two thick kinds are off alike. A thickness that is wrong for all
discs of a kind, as in (3), would do that, and discs of different make would, too; these data cannot tell. The
parameters depend on the interface that is assumed, and the standard errors are those of the noise alone.

`jaxink diagnose` refuses the file, as its rows are no BSDF:

> {refusal(*PTFE)}
"""


def composition(single_mm, made) -> str:
    """Thicknesses of the discs of a stack."""
    return " + ".join(f"{thickness:g}" for thickness in np.repeat(single_mm, made))


def points_left(data: Discs, fits: dict[str, DiscFit]) -> str:
    """List of points that a model misses."""
    lines = []
    for name, fit in fits.items():
        pulls = fit.deviation / fit.sigma
        far = [
            f"{data.thickness_mm[k]:g} mm at {data.theta_deg[a]:g}° ({pulls[k, a]:+.1f})"
            for k, a in np.argwhere(np.abs(pulls) > LEAST_PULL)
        ]
        lines.append(f"- {name}: {', '.join(far) or 'none'}")
    return "\n".join(lines)


def percent(share, error=None) -> str:
    """Shares of R and T in percent."""
    if error is None:
        return ", ".join(f"{100 * one:.2f}" for one in share)
    return ", ".join(f"{100 * one:.2f} ± {100 * e:.2f}" for one, e in zip(share, error, strict=True))


def sphere_section() -> str:
    """Readings of a sphere with and without the light that comes out beside the port."""
    found = [inferred(slab) for sample in SAMPLES for slab in slabs(*sample)]
    readings, losses, coefficients, verdicts = [], [], [], []
    for one in found:
        slab = one.slab
        head = [f"`{slab.name}`", f"{slab.wavelength_nm:g}"]
        numbers = (*slab.readings, *one.totals)
        readings.append(
            [*head, f"{slab.asymmetry:.3g}", *(f"{x:.4f}" for x in numbers), f"{one.totals.sum():.3f}"]
        )
        in_all = percent(one.lost[IN_ALL], one.lost_error)
        losses.append([*head, percent(one.lost[IN_SLIDES]), percent(*one.lost_squeezed), in_all])
        pairs = [f"{np.exp(x[0]):.4g}, {x[1]:.3g}" for x in one.parameters.values()]
        changes = [f"{one.change(loss):+.1f}" for loss in (IN_SLIDES, IN_ALL)]
        changes += [f"{one.changed_to(absorption):+.1f}" for absorption in one.by_reflectance.values()]
        coefficients.append([*head, *pairs, *changes])
        verdicts.append(
            [
                *head,
                *(f"{misfit:.0e}" for misfit in one.misfits.values()),
                f"{one.rank} of {one.jacobian.shape[1]}",
                f"{one.outside:.0e}",
                f"{one.condition:.1f}",
                one.verdict,
            ]
        )
    thin = found[-len(SAMPLES[-1][1])]
    simplest = thin.slab
    simpler = [
        [name, percent(library), percent(*photons)]
        for name, library, photons in losses_in_slides(simplest, thin.parameters[NO_LOSS])
    ]
    head = ["sample", "nm"]
    coefficient_header = [*LOSSES, f"change, {IN_SLIDES}, %", f"change, {IN_ALL}, %"]
    coefficient_header += [f"change, {name} + {REFLECTANCE_ERROR:g}, %" for name in REFLECTANCES]
    loss_header = [f"jaxink: {IN_SLIDES}", "photons: thin ink, in the slides", f"photons: {IN_ALL}"]
    verdict_header = [
        *(f"misfit, {loss}" for loss in LOSSES),
        "rank of the derivatives",
        "loss beyond the other two",
        "condition of the other two",
        "verdict",
    ]
    return f"""## Totals of an integrating sphere (`{SPHERE}`): light beside the port

Collected by Scott Prahl in the repository scottprahl/iad; the contributors are named in its files. One thick
and one thin sample, each between two slides, normal incidence, one sphere at a time:

{geometry(found)}

**From readings to totals.** Let r_w be the reflectance of the wall, a_sample, a_third and a_detector the
shares of the ports in the area of the sphere, and r the reflectance at the sample port. Without a baffle the
gain is G(r) with 1 / G(r) = 1 - r_w (1 - a_sample - a_third - a_detector) - a_sample r, and in the
single-sphere formulas of Prahl's manual and program of inverse adding-doubling (see also Pickering et al.
1993 Appl. Opt. 32, 399)

- M_R = R G(R_d) / G(r_standard),
- M_T = T G(R_d) / G'(r_standard), G' for the standard in the exit port and an open sample port,

R_d being the reflectance of the slab for diffuse light. This is approximate. Whether there were baffles is
not known; the detector is taken as black, regular light as collected on both sides, and R_d as free of loss.
Wall and standard are the numbers of the table for all wavelengths; the original file of the titanium dioxide
has others for each wavelength, which are not in the copy. Scattering and absorption are sought with these
formulas inside, at a fixed g: {SAMPLES[0][2]:g} for the titanium dioxide (assumed), the file's own values for
the other. R and T below meet the readings if no light is lost.

{table([*head, "g", "M_R", "M_T", "R", "T", "R + T"], readings)}

**Light lost sideways.** Nothing is free here: beam and sample port are declared. jaxink's lateral loss
(`beam_diameter_mm`, `detector_diameter_mm`) is integrated over both hemispheres. It solves these stacks, with
slides on both sides, but follows light sideways in clear layers only; in a scattering layer it keeps its
place. That suits inks of some micrometres, not these samples. So the loss was also counted by
`benchmarks.montecarlo` with {N_PHOTONS} photons, which walk in the ink, too; and, to compare like with
like, with an ink {SQUEEZED:g} times thinner of the same optical thickness. The edge of the sample is taken as
far away. Share of R, share of T, in percent:

{table([*head, *loss_header], losses)}

The two columns for the slides do not agree for the thin sample. `{simplest.name}` at
{simplest.wavelength_nm:g} nm, made simpler step by step at the same reduced scattering:

{table(["case", *loss_header[:2]], simpler)}

This fits two approximations that the library states: it forgets the azimuth between two passages, which
forward scattering keeps, and of light that is reflected to and fro between the face and the ink it counts the
first way only, while a slide denser than the ink reflects much near grazing. Its loss comes out too small
here.

**What it does to the absorption.** Reduced scattering and absorption in 1/mm, and the change of the
absorption from that without loss; beside it, its change if the stated reflectance of the standard or of the
wall were higher by {REFLECTANCE_ERROR:g}:

{table([*head, *coefficient_header], coefficients)}

{comparison(found)}

The photons' noise is in these changes. For the thick sample an error of a stated reflectance moves the
absorption about as much as the loss does.

**Verdict.** The misfit is the largest |model / reading - 1|. The derivatives are those of both readings by
scattering, absorption and the strength of the loss. "Loss beyond the other two" is the share of its
derivative that the other two cannot imitate.

{table([*head, *verdict_header], verdicts)}

Both readings are met to rounding with the loss and without it. Two readings fix two coefficients, and nothing
is left to test with: two derivatives that are not parallel span both readings, so that the loss has no
direction of its own, and an absorption can stand in for it. That the loss changes the absorption follows from
the declared geometry, not from these data. It would take a reading with another port, beam or thickness, or
light resolved in angle.

`jaxink diagnose` does not get that far; it refuses the file:

> {refusal(SPHERE, "totals.csv", SAMPLES[0][0])}
"""


def geometry(found: list[Inferred]) -> str:
    """What the files say of the samples and the spheres."""
    columns = {
        "sample, mm": "sample_thickness_mm",
        "each slide, mm": "slide_thickness_mm",
        "beam, mm": "beam_diameter_mm",
        "sphere, mm": "R_sphere_d_mm",
        "sample port, mm": "R_sample_port_mm",
        "third port, mm": "R_entrance_port_mm",
        "detector port, mm": "R_detector_port_mm",
        "wall": "R_wall",
        "standard": "r_standard",
    }
    slabs_by_name = {one.slab.name: one.slab for one in found}
    rows = [
        [f"`{name}`", *(f"{slab.length(key):g}" for key in columns.values())]
        for name, slab in slabs_by_name.items()
    ]
    return table(["sample", *columns], rows)


def comparison(found: list[Inferred]) -> str:
    """Largest loss and change of the absorption of each sample."""
    parts = []
    for name in dict.fromkeys(one.slab.name for one in found):
        of_sample = [one for one in found if one.slab.name == name]
        lost = 100 * np.max([one.lost[IN_ALL] for one in of_sample], axis=0)
        changes = [one.change(IN_ALL) for one in of_sample]
        slab = of_sample[0].slab
        beam, port = slab.radii_mm
        parts.append(
            f"- `{name}`, {slab.thickness_mm:g} mm thick, port {port / beam:.1f} times the beam: up to "
            f"{lost[0]:.1f} % of R and {lost[1]:.1f} % of T are lost, and the absorption changes by "
            f"{min(changes):+.1f} to {max(changes):+.1f} %."
        )
    return "\n".join(parts)


def main() -> None:
    """Write the page."""
    with computing():
        sections = f"{discs_section()}\n{sphere_section()}"
    text = f"""# Measured totals

Transmittances, and readings of an integrating sphere, by others; no BSDF was measured. The data are not part
of the repository; this page is made by `python -m benchmarks.validation.totals`
({machine()}).

{sections}"""
    write_page("measured-totals.md", text)


if __name__ == "__main__":
    main()
