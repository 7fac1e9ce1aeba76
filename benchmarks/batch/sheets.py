"""Simulated sheets of a print line, the forward model plus noise, and troubles among them."""

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np

import jaxink

SAMPLE = """\
# SIMULATED sheets: ink behind a clear plate.
schema_version = 1
wavelength_nm = 550
[[layers]]
name = "plate"
kind = "clear"
refractive_index = 1.5
thickness_mm = 1.0
[[layers]]
name = "ink"
kind = "scattering"
phase_function = "henyey_greenstein"
refractive_index = 1.5
thickness_um = 80
scattering_per_mm = { free = true, min = 1, max = 1000 }
absorption_per_mm = { free = true, min = 0, max = 50 }
asymmetry_parameter = { free = true, min = -0.9, max = 0.95 }
[noise]
scan_relative = 0.002
"""
HEAD = "theta_i_deg,theta_o_deg,phi_deg,wavelength_nm,side,bsdf_per_sr,sigma_per_sr"
FREE = ("ink.scattering_per_mm", "ink.absorption_per_mm", "ink.asymmetry_parameter")
ACCURACY = 1e-3
# What the wrapper of `benchmarks.batch.faults` does at sheets of these names.
HANGS, EATS, DIES, RAISES = "hangs", "eats_memory", "kills_its_process", "raises"
FEW_STEPS = "does_not_converge"


@dataclasses.dataclass(frozen=True)
class Trouble:
    """A kind of trouble: what is done to the text of a good sheet, and the outcome that is right.

    ``edit`` returns the bytes of the file, or None for no file. ``cell`` replaces the thickness of the ink in
    the table of measurements.
    """

    name: str
    outcome: str
    edit: Callable[[list[str]], bytes | None] = lambda lines: "\n".join(lines).encode()
    suffix: str = ".csv"
    cell: str = ""
    verdict: str | None = None


def _text(change: Callable[[list[str]], list[str]]) -> Callable[[list[str]], bytes]:
    return lambda lines: "\n".join(change(lines)).encode()


def _column(index: int, change: Callable[[str], str], rows: slice = slice(1, None)):
    def edit(lines: list[str]) -> list[str]:
        chosen = set(range(len(lines))[rows])
        cells = [line.split(",") for line in lines]
        for i in chosen:
            cells[i][index] = change(cells[i][index])
        return [",".join(row) for row in cells]

    return _text(edit)


def _times_cosine(lines: list[str]) -> list[str]:
    """What an instrument gives that divides by the solid angle only: value and sigma times cos(theta_o)."""
    cells = [line.split(",") for line in lines]
    for row in cells[1:]:
        cosine = float(np.cos(np.radians(float(row[1]))))
        row[5:7] = [f"{float(value) * cosine:.8g}" for value in row[5:7]]
    return [",".join(row) for row in cells]


def _without(index: int):
    return _text(lambda lines: [",".join(c for i, c in enumerate(x.split(",")) if i != index) for x in lines])


TROUBLES = (
    Trouble("missing_file", "refused", lambda _: None),
    Trouble("empty_file", "refused", lambda _: b""),
    Trouble("times_cosine", "done", _text(_times_cosine), verdict="misfit"),
    Trouble("value_nan", "refused", _column(5, lambda _: "nan", slice(7, 8))),
    Trouble("value_is_text", "refused", _column(5, lambda _: "saturated", slice(9, 10))),
    Trouble("no_column_side", "refused", _without(4)),
    Trouble("angle_beyond_90", "refused", _column(1, lambda v: str(float(v) + 30), slice(-3, None))),
    Trouble("side_unknown", "refused", _column(4, lambda _: "front", slice(5, 6))),
    Trouble("other_wavelength", "refused", _column(3, lambda _: "650")),
    Trouble("sigma_negative", "refused", _column(6, lambda v: f"-{v}", slice(4, 5))),
    Trouble("truncated_row", "refused", _text(lambda lines: [*lines[:-1], lines[-1][:9]])),
    Trouble("binary", "refused", lambda _: bytes(range(256)) * 40),
    Trouble("unknown_format", "refused", suffix=".mat"),
    Trouble("thickness_impossible", "refused", cell="-1"),
    Trouble("percent", "refused", _column(5, lambda v: repr(100 * float(v)))),
    Trouble(FEW_STEPS, "not_converged", verdict="not_converged"),
    Trouble(HANGS, "time_limit"),
    Trouble(EATS, "memory_limit"),
    Trouble(DIES, "killed"),
    Trouble(RAISES, "failed"),
)


def points() -> tuple[np.ndarray, ...]:
    """Incidence, viewing angle and azimuth, deg, and whether the point is seen behind the sheet."""
    rows = []
    for theta_i in (0.0, 30.0, 60.0):
        for signed in np.arange(-70.0, 71.0, 14.0):
            rows.append((theta_i, abs(signed), 180.0 if signed >= 0 else 0.0, False))
        rows += [(theta_i, theta, 180.0, True) for theta in np.arange(0.0, 71.0, 10.0)]
    columns = np.array([row[:3] for row in rows]).T
    return (*columns, np.array([row[3] for row in rows]))


def truths(count: int, seed: int = 25) -> list[dict[str, float]]:
    """Parameters of the sheets: a slow drift and a scatter of the ink, whose thickness is measured."""
    random, drift = np.random.default_rng(seed), np.sin(np.linspace(0, 3, count))
    scatter = random.normal(size=(count, 4))
    return [
        {
            "ink.scattering_per_mm": 60 * (1 + 0.1 * drift[i] + 0.02 * scatter[i, 0]),
            "ink.absorption_per_mm": 2 * (1 + 0.03 * scatter[i, 1]),
            "ink.asymmetry_parameter": 0.6 + 0.01 * scatter[i, 2],
            "ink.thickness_um": round(80 * (1 + 0.02 * scatter[i, 3]), 3),
        }
        for i in range(count)
    ]


def write_sheets(folder: Path, count: int, troubles: tuple[Trouble, ...] = (), **options) -> Path:
    """Write sheets, their table, the sample file and the plan; return the plan.

    The last sheets of the run's every tenth have troubles. ``options`` are lines of the plan by table.
    """
    (folder / "sheets").mkdir(parents=True, exist_ok=True)
    theta_i, theta_o, phi, behind = points()
    predicted = _predictor(theta_i, theta_o, phi, behind)
    random, rows = np.random.default_rng(2025), ["file,ink.thickness_um,x_mm,y_mm"]
    bad = {10 * i + 5: trouble for i, trouble in enumerate(troubles)}
    for number, truth in enumerate(truths(count)):
        values = predicted(truth)
        sigma = 0.005 * values + 1e-5
        noisy = values * (1 + 0.002 * _of_scans(theta_i, behind, random)) + sigma * random.normal(
            size=len(sigma)
        )
        lines = [HEAD]
        for i in range(len(values)):
            numbers = f"{theta_i[i]:g},{theta_o[i]:g},{phi[i]:g},550,{'T' if behind[i] else 'R'}"
            lines.append(f"{numbers},{noisy[i]:.8g},{sigma[i]:.4g}")
        trouble = bad.get(number)
        name = f"sheet_{number:04d}" + (f"_{trouble.name}" if trouble else "")
        file = f"sheets/{name}{trouble.suffix if trouble else '.csv'}"
        content = trouble.edit(lines) if trouble else "\n".join(lines).encode()
        if content is not None:
            (folder / file).write_bytes(content)
        cell = (trouble.cell if trouble else "") or f"{truth['ink.thickness_um']:.3f}"
        rows.append(f"{file},{cell},{12 * (number % 20)},{12 * (number // 20)}")
    (folder / "sheets.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    (folder / "sample.toml").write_text(SAMPLE, encoding="utf-8")
    plan = [
        "schema_version = 1",
        'title = "SIMULATED sheets"',
        'sample = "sample.toml"',
        *(f"{key} = {value}" for key, value in options.pop("top", {}).items()),
        '[measurements]\ntable = "sheets.csv"',
        f'[fit]\naccuracy = {ACCURACY}\nprofile = "none"',
    ]
    plan += [f"[{key}]\n{lines}" for key, lines in options.items()]
    (folder / "plan.toml").write_text("\n".join(plan) + "\n", encoding="utf-8")
    return folder / "plan.toml"


def _predictor(theta_i, theta_o, phi, behind) -> Callable[[dict[str, float]], np.ndarray]:
    """The forward model as a function of the parameters of a sheet."""
    import jax

    free = SAMPLE.replace("thickness_um = 80", "thickness_um = { free = true, min = 1, max = 200 }")
    columns = theta_i, theta_o, phi, np.full(len(phi), 550.0), behind
    model = jaxink.ForwardModel(jaxink.parse_sample(free), *columns, accuracy=ACCURACY)
    bsdf = jax.jit(model.bsdf)

    def predicted(truth: dict[str, float]) -> np.ndarray:
        with jax.enable_x64(True):
            return np.asarray(bsdf(truth))

    return predicted


def _of_scans(theta_i: np.ndarray, behind: np.ndarray, random) -> np.ndarray:
    """A factor common to each scan."""
    keys = theta_i + 1000 * behind
    return random.normal(size=len(np.unique(keys)))[np.unique(keys, return_inverse=True)[1]]
