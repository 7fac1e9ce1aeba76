"""Time of the forward model with one rough face against the smooth one, interleaved, and write rough.md.

python -m benchmarks.speed.rough
"""

import re
import time

import equinox as eqx
import jax
import numpy as np

import jaxink
from benchmarks.pages import machine, table, write_page
from benchmarks.simulated_data import data_file, declared_text
from jaxink.numerics.precision import computing

NAME, ROUNDS = "white_ink_rough", 60
SCANNED = "the same, in a fit that scans the radius (from a table over angle and index)"
_SIGMA = "sigma_deg = { free = true, value = 5, min = 0.5, max = 25 }"


def samples() -> dict[str, str]:
    """Sample files: smooth, one rough face with its angle free, and two densities with all numbers free."""
    text = declared_text(NAME)
    two = (
        f'density = "beckmann", {_SIGMA}, second_density = "ggx", '
        "second_sigma_deg = { free = true, value = 15, min = 5, max = 40 }, "
        "second_weight = { free = true, value = 0.5, min = 0, max = 1 }"
    )
    heights = (
        'spectrum = "k_correlation", '
        "height_rms_um = { free = true, value = 0.2, min = 0.05, max = 1 }, "
        "length_b_um = { free = true, value = 8, min = 1, max = 50 }, "
        "exponent = { free = true, value = 4, min = 2.1, max = 8 }"
    )
    free_index = re.sub(
        r'(phase_function = "mie"\nrefractive_index = )1.5',
        r"\1{ free = true, value = 1.52, min = 1.4, max = 1.6 }",
        text,
    )
    face, angle = r"back_roughness = .*\n", r"sigma_deg = [0-9.]+"
    return {
        "smooth": re.sub(face, "", text),
        "one density, angle free (from a table)": re.sub(angle, _SIGMA, text),
        "two densities, all numbers free (from tables)": re.sub(
            r"(back_roughness = \{).*\}", rf"\1 {two} }}", text
        ),
        "waves, K-correlation (computed in every step)": re.sub(
            r"(back_roughness = \{).*\}", rf"\1 {heights} }}", text
        ),
        "smooth, index of the ink free": re.sub(face, "", free_index),
        "one density, angle and index of the ink free (computed in every step)": re.sub(
            angle, _SIGMA, free_index
        ),
    }


def main() -> None:
    """Write the page."""
    data = jaxink.read(data_file(NAME))
    runs, built = {}, {}
    with computing():
        given = [(name, text, False) for name, text in samples().items()]
        given.append((SCANNED, given[-1][1], True))
        for name, text, is_scanned in given:
            sample = jaxink.parse_sample(text)
            start = time.perf_counter()
            model = jaxink.ForwardModel(sample, *data.directions)
            model = model.tabulated() if is_scanned else model
            jax.block_until_ready(eqx.filter(model.rough_tables, eqx.is_array))
            built[name] = time.perf_counter() - start
            free = {p.name: float(p.value) for p in sample.parameters.values() if p.free}
            value = eqx.filter_jit(lambda m, v: m.bsdf(v))
            jacobian = eqx.filter_jit(lambda m, v: jax.jacfwd(m.bsdf)(v))
            runs[name] = [(f, model, free) for f in (value, jacobian)]
            for f, *arguments in runs[name]:
                jax.block_until_ready(f(*arguments))
        seconds = {name: ([], []) for name in runs}
        for _ in range(ROUNDS):
            for name, both in runs.items():
                for k, (f, *arguments) in enumerate(both):
                    start = time.perf_counter()
                    jax.block_until_ready(f(*arguments))
                    seconds[name][k].append(time.perf_counter() - start)
    medians = {name: [np.median(s) for s in both] for name, both in seconds.items()}
    rows, smooth = [], medians["smooth"]
    for name, (value, jacobian) in medians.items():
        # Each is compared with the smooth sample above it, which has the same channels.
        smooth = (value, jacobian) if name.startswith("smooth") else smooth
        rows.append(
            [
                name,
                f"{1e3 * value:.1f}",
                f"{value / smooth[0]:.2f}",
                f"{1e3 * jacobian:.1f}",
                f"{jacobian / smooth[1]:.2f}",
                f"{built[name]:.1f}",
            ]
        )
    header = [
        "ink-air face",
        "BSDF, ms",
        "over smooth",
        "Jacobian in all free parameters, ms",
        "over smooth",
        "building the model once, s",
    ]
    text = f"""# Computing time of a rough face

The sample is the simulated plate `{NAME}`: {len(data)} directions, five incidences, a Mie ink, automatic
resolution. Times are medians of {ROUNDS} rounds in which all models take turns. Made by
`python -m benchmarks.speed.rough` ({machine()}).

{table(header, rows)}

A face between fixed indices is tabulated over the ranges of its angles before the fit. Two densities are
tabulated apart: what their facets do at each meeting adds up, and light that meets several of them follows
from the sum. Otherwise the integrals over the facets, or over the spectrum of heights, are computed again in
every step, and their derivatives by the numbers of the face and by the free indices only.

Beside a single free index, a fit that scans a radius first, which takes more than a thousand Jacobians, also
tabulates the face over the index. That takes as long as about a hundred Jacobians without the table, so other
fits do not. The range of the index is divided where it passes another medium's; a table of more than 256 MB,
as of four wavelengths, is not made.
"""
    write_page("rough.md", text)


if __name__ == "__main__":
    main()
