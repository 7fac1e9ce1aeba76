"""Joint fits of several measurements, and docs/validation/joint.md.

python -m benchmarks.validation.joint four|rough|pull|lacking|cost|readings|forecast|next|real|page

Each task makes the rows of results.json that are missing; remove a row to repeat it.
"""

import argparse
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from benchmarks.pages import filled, machine, table, write_page
from benchmarks.validation.joint import (
    cost,
    discs,
    forecast,
    four,
    lacking,
    lacking_readings,
    next_one,
    pull,
    real,
    rough,
    spheres,
    three_readings,
)
from jaxink.numerics.digits import percent, rounded, with_uncertainty

RESULTS = Path(__file__).with_name("results.json")
_DRAWS = range(10)
_LACKING, _READINGS_LACKING = range(2), range(3)
_PLANNED = range(3)
_OF_BSDF, _OF_READINGS = "lacking", "readings that lack"
# Until so many of them are undecided before.
_MOST_TRIED, _UNDECIDED = 16, 10
_SHORT = {
    "ink.radius_nm": "radius, nm",
    "ink.volume_fraction": "volume fraction",
    "ink.particle_index": "index",
    "ink.particle_absorption_index": "absorption index",
    "ink.back_roughness.sigma_deg": "slope angle, degrees",
    "thin/ink.thickness_um": "thickness (thin), um",
    "thick/ink.thickness_um": "thickness (thick), um",
}

_NO_MINIMUM = "The joint search did not end in a minimum, so the measurements were not compared."


def _rows() -> Iterator[tuple[str, str, Callable[[], dict | list]]]:
    """Task, name and work of every row."""
    for is_free in (False, True):
        for chosen in four.combinations():
            name = f"{'free' if is_free else 'declared'}: {'; '.join(chosen)}"
            yield "four", name, lambda chosen=chosen, is_free=is_free: four.fitted(chosen, is_free)
    for is_free in (False, True):
        for chosen in rough.CHOSEN:
            name = f"rough, {'free' if is_free else 'declared'}: {'; '.join(chosen)}"
            yield "rough", name, lambda chosen=chosen, is_free=is_free: rough.fitted(chosen, is_free)
    for seed in _DRAWS:
        for wrong in (None, *pull.SHEETS):
            yield "pull", f"pull {seed} {wrong}", lambda seed=seed, wrong=wrong: pull.found(seed, wrong)
    for seed in _LACKING:
        for kind in lacking.LACKS:
            name = f"{_OF_BSDF} {seed} {kind}"
            yield "lacking", name, lambda seed=seed, kind=kind: lacking.found(seed, kind)
    for seed in _READINGS_LACKING:
        for kind in lacking_readings.LACKS:
            name = f"{_OF_READINGS} {seed} {kind}"
            yield "lacking", name, lambda seed=seed, kind=kind: lacking_readings.found(seed, kind)
    yield "cost", "cost", cost.seconds
    for seed in _DRAWS:
        yield "readings", f"readings {seed}", lambda seed=seed: three_readings.found(seed)
    for seed in range(_MOST_TRIED):
        yield "next", f"next {seed}", lambda seed=seed: next_one.found(seed)
    for seed in _PLANNED:
        yield "forecast", f"forecast {seed}", lambda seed=seed: forecast.found(seed)
    for name in real.SAMPLES:
        yield "real", name, lambda name=name: real.fitted(name)
    yield "real", discs.NAME, discs.fitted
    for name in spheres.SERIES:
        yield "real", name, lambda name=name: spheres.series_fitted(name)
    yield "real", spheres.LOST, spheres.share_beside_port
    for name in spheres.PHANTOMS:
        yield "real", name, lambda name=name: spheres.phantom_fitted(name)


def _make(task: str, results: dict) -> None:
    for kind, name, work in _rows():
        undecided = sum(bool(row.get("undecided")) for n, row in results.items() if n.startswith("next"))
        if kind == "next" and undecided >= _UNDECIDED:
            continue
        if kind == task and name not in results:
            results[name] = work()
            RESULTS.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
            print(name, json.dumps(results[name])[:300], flush=True)


def _write_page(results: dict) -> None:
    here = Path(__file__).parent
    made = {
        "declared": _four(results, "declared", four.combinations()),
        "free": _four(results, "free", four.combinations()),
        "rough_declared": _four(results, "rough, declared", rough.CHOSEN),
        "rough_free": _four(results, "rough, free", rough.CHOSEN),
        "pull": _pull(results),
        "lacking": _lacking(results, _OF_BSDF, lacking.LACKS),
        "lacking_readings": _lacking(results, _OF_READINGS, lacking_readings.LACKS),
    }
    made |= {"cost": _cost(results), "machine": machine()}
    made |= {"summary": _summary(results, ""), "rough_summary": _summary(results, "rough, ")}
    made |= {
        "real": _real(results),
        "discs": discs.told(results.get(discs.NAME)),
        "spheres": spheres.told(results),
        "readings": _readings(results),
        "forecast": _forecast(results),
        "held": _held(results),
        "next": _next(results),
        "decided": _decided(results),
    }
    write_page("joint.md", filled(here / "joint.md.in", **made))


def _four(results: dict, kind: str, combinations: Sequence[tuple[str, ...]]) -> str:
    heads = ["measurements", "reduced chi-square", "p of disagreement", "minima not excluded", "next minimum"]
    is_free, is_rough = kind.endswith("free"), kind.startswith("rough")
    names = [n for n in _SHORT if (is_free or "thickness" not in n) and (is_rough or "roughness" not in n)]
    body = []
    for chosen in combinations:
        found = results.get(f"{kind}: {'; '.join(chosen)}")
        if found is None:
            continue
        row = ["all four" if len(chosen) == 4 else "; ".join(chosen), rounded(found["reduced_chi_square"], 4)]
        row += [rounded(found["probability_of_disagreement"], 2) or "-", str(found["comparable_minima"])]
        row.append("-" if found["next_minimum"] is None else f"+{found['next_minimum']:.3g}")
        for name in names:
            row.append(_value(found["parameters"].get(name)))
        body.append(row)
    return table([*heads, *(_SHORT[n] for n in names)], body)


def _value(p: dict | None) -> str:
    """Value with its standard error, and its distance from the truth in standard errors."""
    if p is None:
        return "-"
    if p["standard_error"] is None:
        return f"{rounded(p['value'], 4)}, {p['flag'] or 'no standard error'}"
    return f"{with_uncertainty(p['value'], p['standard_error'])} ({p['errors_off']:+.1f})"


def _summary(results: dict, prefix: str) -> str:
    """How many values are within three standard errors of the truth."""
    found = [
        p["errors_off"]
        for name, row in results.items()
        if name.startswith((f"{prefix}declared", f"{prefix}free"))
        for p in row["parameters"].values()
        if p["errors_off"] is not None
    ]
    within = sum(abs(off) < 3 for off in found)
    return f"{within} of {len(found)} values with a standard error are within three of the truth."


def _pull(results: dict) -> str:
    rows = []
    for wrong in (None, *pull.SHEETS):
        here = [results[f"pull {seed} {wrong}"] for seed in _DRAWS if f"pull {seed} {wrong}" in results]
        if not here:
            continue
        named = sum(one["named"] == wrong for one in here if wrong is not None)
        other = sum(one["named"] not in (None, wrong) for one in here)
        disagree = sum(one["disagrees"] for one in here)
        rows.append([wrong or "none", str(len(here)), str(disagree), str(named), str(other)])
    return table(["measurement that is 3 % too high", "inks", "disagree", "named", "another one named"], rows)


def _readings(results: dict) -> str:
    rows = []
    for seed in _DRAWS:
        found = results.get(f"readings {seed}")
        if found is None:
            continue
        row = [rounded(found["optical_thickness"], 3), f"{100 * found['extinction_off']:+.2f} %"]
        for name in ("ink.scattering_per_mm", "ink.absorption_per_mm", "ink.asymmetry_parameter"):
            p = found["parameters"][name]
            row.append(f"{_value(p)} : {rounded(p['true'], 4)}")
        rows.append([*row, str(found["comparable_minima"])])
    heads = [
        "optical thickness",
        "error of the extinction",
        "scattering, 1/mm : true",
        "absorption, 1/mm : true",
    ]
    return table([*heads, "asymmetry : true", "minima not excluded"], rows)


def _forecast(results: dict) -> str:
    """Foreseen standard errors beside those of ten fits, and the scatter of these about the truth."""
    rows = []
    for seed in _PLANNED:
        found = results.get(f"forecast {seed}")
        if found is None:
            continue
        for name, foreseen in found["foreseen"].items():
            off, errors = np.array([draw[name] for draw in found["draws"]]).T
            least, largest = found["ranges"][name]
            row = [
                found["measurement"],
                name,
                rounded(found["truth"][name], 3),
                rounded(found["now"][name], 2),
            ]
            row += [f"{rounded(foreseen, 2)} ({rounded(least, 2)} to {rounded(largest, 2)})"]
            row += [f"{rounded(errors.min(), 2)} to {rounded(errors.max(), 2)}"]
            rows.append([*row, f"{np.sqrt(np.mean((off / errors) ** 2)):.2f}"])
    heads = ["first of the plan", "parameter", "truth", "now", "foreseen", "fitted"]
    return table([*heads, "rms distance from the truth, s.e."], rows)


def _held(results: dict) -> str:
    """How many fitted standard errors are within a quarter of what was foreseen."""
    near, within, count = 0, 0, 0
    for seed in _PLANNED:
        found = results.get(f"forecast {seed}", {"draws": []})
        for draw in found["draws"]:
            for name, (_, error) in draw.items():
                least, largest = found["ranges"][name]
                near += abs(error / found["foreseen"][name] - 1) <= 0.25
                within += 0.75 * least <= error <= 1.25 * largest
                count += 1
    return (
        f"Of {count} fitted standard errors, {near} are within 25 % of the number foreseen, {within} within "
        "25 % of its range."
    )


def _next(results: dict) -> str:
    rows = []
    for name, found in results.items():
        if name.startswith("next") and found["undecided"]:
            worst = max((abs(off) for off in found["errors_off"].values() if off is not None), default=np.nan)
            rows.append(
                [
                    str(found["minima_before"]),
                    found["measurement"],
                    rounded(found["forecast"], 3),
                    percent(found["chance"], ".0f"),
                    str(found["minima_after"]),
                    f"{worst:.1f}",
                ]
            )
    heads = ["minima before", "first of the plan", "separation foreseen", "chance", "minima after"]
    return table([*heads, "largest distance from the truth, s.e."], rows)


def _decided(results: dict) -> str:
    """How many cases the first measurement of the plan decides, and how many it foresees to decide."""
    found = [one for name, one in results.items() if name.startswith("next") and one["undecided"]]
    decided = sum(one["minima_after"] == 1 for one in found)
    foreseen = sum(one["chance"] for one in found)
    return (
        f"The first measurement of the plan decides {decided} of {len(found)} cases; the chances that the "
        f"plans state add up to {foreseen:.1f}."
    )


def _lacking(results: dict, rows_of: str, kinds: Iterable[str]) -> str:
    rows = []
    for kind in kinds:
        made = [
            found for name, found in results.items() if name.startswith(rows_of) and found["kind"] == kind
        ]
        if not made:
            continue
        right = [bool(one["steps"]) and one["steps"][0][:2] == [one["effect"], one["sheets"]] for one in made]
        false = [max(len(one["steps"]) - is_right, 0) for one, is_right in zip(made, right, strict=True)]
        rows.append(
            [
                kind,
                f"{sum(right)} of {len(made)}" if made[0]["effect"] else "-",
                str(sum(false)),
                "; ".join("{:.4g} : {:.4g}".format(*one["reduced"]) for one in made),
                "; ".join("{:.2g} : {:.2g}".format(*one["worst_parameter"]) for one in made),
                f"{np.median([one['seconds'] for one in made]):.0f}",
            ]
        )
    if not rows:
        return "No case was run to its end yet."
    heads = ["not declared", "named first, where it is", "other names"]
    heads += ["reduced chi-square, declared : corrected", "largest distance from the truth, s.e., likewise"]
    return table([*heads, "seconds"], rows)


def _real(results: dict) -> str:
    rows = []
    for sample in real.SAMPLES:
        found = results.get(sample)
        if found is None:
            continue
        for name, alone in found["alone"].items():
            joint = {n.rpartition("/")[2]: v for n, v in found["values"].items() if "/" not in n or name in n}
            pairs = (f"{p} {rounded(v, 4)} : {rounded(joint[p], 4)}" for p, v in alone["values"].items())
            row = [f"`{sample}`", name.replace("_", " "), "; ".join(pairs)]
            row += [f"{percent(alone['rms'])} : {percent(found['rms'][name])}"]
            row += [f"{rounded(alone['reduced_chi_square'], 3)} : {rounded(found['reduced'].get(name), 3)}"]
            rows.append(row)
    heads = ["sample", "measurement", "parameters, alone : together", "rms of measured / model - 1"]
    said = [f"- `{n}`: {results[n]['agreement'] or _NO_MINIMUM}" for n in real.SAMPLES if n in results]
    return "\n".join([table([*heads, "reduced chi-square"], rows), "", *said])


def _cost(results: dict) -> str:
    rows = results.get("cost", [])
    if not rows:
        return ""
    first, again = rows[0]["first_s"], rows[0]["again_s"] / rows[0]["jacobians"]
    body = [
        [
            str(one["measurements"]),
            f"{one['first_s']:.1f}",
            f"{one['again_s']:.2f}",
            str(one["jacobians"]),
            f"{one['again_s'] / one['jacobians'] / again / one['measurements']:.2f}",
            f"{one['first_s'] / first:.2f}",
        ]
        for one in rows
    ]
    heads = ["measurements", "first fit, s", "another fit, s", "Jacobians"]
    return table([*heads, "time of a Jacobian / (number x that of one)", "first fit / that of one"], body)


def main() -> None:
    """Do what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "tasks",
        nargs="+",
        choices=("four", "rough", "pull", "lacking", "cost", "readings", "forecast", "next", "real", "page"),
    )
    results = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.exists() else {}
    for task in parser.parse_args().tasks:
        _make(task, results)
    _write_page(results)


if __name__ == "__main__":
    main()
