"""Error of the exported BSDF inside the plate, declared and corrected, for every undeclared effect.

python -m benchmarks.validation.simulated.inside [NAME ...]

Each case is diagnosed in a process of its own from its declared file alone; what was found is kept in
inside/NAME.json, and its report with those of `diagnosis`. With names, only these are computed again. The
section of simulated.md is written from all that is kept.
"""

import dataclasses
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.pages import machine, table, write_section
from benchmarks.simulated_data import declared_text, names, truth_of
from benchmarks.validation.simulated.diagnosis import EFFECT_OF, diagnose, true_strengths, true_values

MARK = "inside the plate, by benchmarks.validation.simulated.inside"
KEPT = Path(__file__).parent / "inside"
_WRONG_PERCENT = 1.0
# Effects of the truth files that are properties of the ink.
OF_THE_INK = ("E1", "E2", "E3", "E4", "E10", "E14", "E15")


def true_sample(name: str):
    """The sample as it is: declared values replaced by the true ones, and the ink's effects declared."""
    from jaxink import parse_sample
    from jaxink.effects import CATALOGUE, Case, Scene, declare, with_values

    truth, sample = truth_of(name), parse_sample(declared_text(name))
    values = true_values(truth) | true_strengths(truth)
    effects = truth["effects"]
    if "E2" in effects:
        values["ink.radius_variance_ln"] = np.log(effects["E2"]["sigma_g"]) ** 2
    waves = np.array(sample.wavelengths_nm)
    scene = Scene.of(0 * waves, 30 + 0 * waves, 0 * waves, waves, waves < 0, row=np.arange(waves.size))
    by_name = {effect.name: effect for effect in CATALOGUE}
    forms = []
    for key in effects:
        if key in OF_THE_INK:
            found = by_name[EFFECT_OF[key]].forms(Case(sample, scene))
            kind = effects[key].get("kind")
            (form,) = (f for f in found if kind is None or f.density == kind)
            forms.append(form)
    declared = declare(sample, tuple(forms), values)
    return dataclasses.replace(declared, parameters=with_values(declared.parameters, values))


def examine(name: str) -> dict:
    """Diagnose one case and compare the ink of both models with the true one."""
    import jaxink
    from jaxink.ink.comparison import TableComparison
    from jaxink.ink.tabulate import TableOptions

    with tempfile.TemporaryDirectory() as scratch:
        out = diagnose(name, Path(scratch))
        found = jaxink.load_diagnosis(out)
        again = jaxink.load_sample(out)
        options = jaxink.FitOptions(profile="none", scan=False, config=found.corrected.config)
        refit = jaxink.fit(found.corrected.data, again, options)
        read_back = jaxink.predict(again, found.corrected.data, found.corrected.config)
    options = TableOptions(n_theta=61, n_phi=13)
    declared, corrected, true = (
        jaxink.ink_table(one, options=options)
        for one in (found.declared.sample, found.corrected.sample, true_sample(name))
    )
    used = found.corrected.data.used
    return {
        "verdict": found.verdict.code,
        "effects": list(found.verdict.effects),
        "rewritten": {
            "largest_relative_difference": float(
                np.max(np.abs(read_back[used] / found.corrected.predicted_per_sr - 1))
            ),
            "refit_minus_corrected_chi_square": refit.merit.chi_square - found.corrected.merit.chi_square,
        },
        "errors": {
            model: [
                dataclasses.asdict(TableComparison(true, ink).of(component, w))
                for component in ("R_II", "T_IA", "T_AI", "R_AA")
                for w in range(len(true.wavelength_nm))
            ]
            for model, ink in (("declared", declared), ("corrected", corrected))
        },
    }


def summary(errors: list[dict], components: tuple[str, ...]) -> str:
    """Root mean square and largest error over components and wavelengths, in per cent."""
    chosen = [e for e in errors if e["component"] in components]
    rms = np.sqrt(np.mean([e["rms_percent"] ** 2 for e in chosen]))
    largest = max((e["largest_percent"] for e in chosen), key=abs)
    return f"{rms:.2g} ({largest:+.2g})"


def still_wrong(kept: dict[str, Path]) -> str:
    """Which cases the correction leaves with a wrong ink."""
    names = []
    for name, file in kept.items():
        if file.exists():
            errors = json.loads(file.read_text())["errors"]["corrected"]
            if max(e["rms_percent"] for e in errors if e["component"] == "R_II") > _WRONG_PERCENT:
                names.append(f"`{name.removeprefix('undeclared_')}`")
    if not names:
        return f"After the correction, R_II is within {_WRONG_PERCENT:g} % rms everywhere."
    listed = ", ".join(names)
    return f"After the correction, R_II is still wrong by more than {_WRONG_PERCENT:g} % rms in {listed}."


def main() -> None:
    """Examine what is asked for or missing, and write the section."""
    asked = sys.argv[1:]
    if asked[:1] == ["--one"]:
        print(json.dumps(examine(asked[1]), indent=1))
        return
    KEPT.mkdir(exist_ok=True)
    undeclared = [name for name in names() if name.startswith("undeclared")]
    for name in undeclared:
        file = KEPT / f"{name}.json"
        if name in asked or (not asked and not file.exists()):
            command = [sys.executable, "-m", "benchmarks.validation.simulated.inside", "--one", name]
            done = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True)
            file.write_text(done.stdout)
            print(name, flush=True)
    kept = {name: KEPT / f"{name}.json" for name in undeclared}
    rows = []
    for name, found in ((n, json.loads(file.read_text())) for n, file in kept.items() if file.exists()):
        cells = [
            summary(found["errors"][model], components)
            for components in (("R_II",), ("T_IA", "T_AI"), ("R_AA",))
            for model in ("declared", "corrected")
        ]
        rewritten = found["rewritten"]
        rows.append(
            [
                f"`{name.removeprefix('undeclared_')}`",
                f"{found['verdict']}: {' / '.join(found['effects']) or 'none'}",
                *cells,
                f"{rewritten['refit_minus_corrected_chi_square']:.1g}",
            ]
        )
    header = ["undeclared_...", "verdict"]
    header += [
        f"{what} {when}" for what in ("R_II", "T_IA, T_AI", "R_AA") for when in ("declared", "corrected")
    ]
    text = f"""## The exported BSDF, declared and corrected

Error of the ink's BSDF, as exported, against that of the true ink, in per cent: root mean square, and in
brackets the largest, over all pairs of directions up to 75 degrees from the normal, by the declared model
and by the corrected model that `jaxink diagnose` writes ({machine()};
`python -m benchmarks.validation.simulated.inside`). I is the side of the plate, A that of the air. The true
ink includes the undeclared effects that are its own properties (rough face, sizes and density of the
particles, patches, second lobe, index, air gap), but not those of instrument, plate and backing. The last
column is chi-square
of a fit from the written `sample.toml` minus that of the corrected model.

{table([*header, "refit"], rows)}

{still_wrong(kept)}
"""
    write_section("simulated.md", MARK, text)


if __name__ == "__main__":
    main()
