"""The last section of docs/manual/batch.md."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from benchmarks.batch.stages import WORKERS
from benchmarks.pages import filled, table, write_section

MARK = "made by python -m benchmarks.batch"
HERE = Path(__file__).parent
_NOT_RUN = "The stage `{}` has not been run yet."


def write(known: Mapping[str, Any]) -> None:
    """Write what the stages have found."""
    texts = {
        name: maker(known[name]) if name in known else _NOT_RUN.format(name) for name, maker in _PARTS.items()
    }
    write_section("batch.md", MARK, filled(HERE / "measured.md.in", **texts))


def _troubles(found: dict) -> str:
    rows = [
        [
            f"`{kind}`",
            f"`{outcome}`" + (f", `{verdict}`" if verdict else ""),
            _cell(sentence),
            "yes" if right else "no",
        ]
        for kind, outcome, verdict, sentence, right in found["kinds"]
    ]
    verdicts = ", ".join(f"{n} `{code or 'none'}`" for code, n in found["verdicts"].items())
    n_right = sum(row[4] for row in found["kinds"])
    return (
        f"{n_right} of {len(rows)} troubles have the outcome that is right. {found['good_done']} of the "
        f"{found['good']} good sheets have a result ({verdicts}); {100 * found['within_3_se']:.1f} % of "
        "their "
        "parameters are within three standard errors of the truth.\n\n"
        + table(["trouble", "outcome, verdict", "sentence", "as it should be"], rows)
    )


def _cell(sentence: str) -> str:
    return sentence.replace("|", "\\|").replace("<", "&lt;")


def _kills(found: dict) -> str:
    said = "; ".join(f"{what} at {n} rows" for what, n in found["log"])
    same = "the same" if found["same_words"] else "not all the same"
    return (
        f"Killed: {said}. At the end there were {found['rows']} rows in the summary, {found['row_files']} "
        "files of "
        f"rows, {found['result_folders']} folders of results, {len(found['left_over'])} unfinished files and "
        f"{found['processes_left']} processes that had outlived their batch. Outcomes, verdicts and "
        "sentences are "
        f"{same} as in the undisturbed run; the largest relative difference of a parameter, a standard "
        "error or a "
        f"reduced chi-square is {found['largest_difference']:.1g}."
    )


def _overhead(found: dict) -> str:
    bare, saving, batch = (found[key] for key in ("bare_loop_s", "saving_loop_s", "batch_s"))
    rows = [
        ["loop that reads and fits", f"{1e3 * bare:.0f}", ""],
        ["the same, and saves each result", f"{1e3 * saving:.0f}", f"{100 * (saving / bare - 1):+.0f} %"],
        ["`jaxink batch --workers 0`", f"{1e3 * batch:.0f}", f"{100 * (batch / bare - 1):+.0f} %"],
    ]
    return table(["", "processor time per sheet, ms", "against the first"], rows) + (
        f"\n\nMedians of {found['runs']} runs of {found['sheets']} sheets. A batch also writes a page for "
        "each, the "
        f"summary and the report: {100 * (batch / saving - 1):+.0f} % against the loop that saves."
    )


def _unstated(found: dict) -> str:
    stated, unstated = (1e3 * found[key] for key in ("stated_s", "unstated_s"))
    return (
        "Programs do not depend on the noise: where files state none, and each sheet has a repeatability of "
        f"scans of its own ({found['noises']} in {found['sheets']} sheets of 648 rows whose scans differ by "
        f"2 %), a fit takes {unstated:.0f} ms of processor time, against {stated:.0f} ms with stated noise. "
        f"The search is {100 * found['stated_search_share']:.0f} % of the time of the latter."
    )


def _first(found: dict) -> str:
    return (
        f"With programs stored, two workers gave the first result {found['first_s']:.1f} s after the "
        "start, and the "
        f"second one {found['second_after_s']:.2f} s after it (load of the machine: {found['load']:.1f} on "
        "2 cores)."
    )


def _scaling(found: dict) -> str:
    return (
        f"One worker: {found['one_per_s']:.2f} sheets per second; two: {found['two_per_s']:.2f}, "
        f"{found['ratio']:.2f} times as many (medians of {found['runs']} runs in turns, second half of "
        "each run; "
        f"load of the machine: {found['load']:.1f} on 2 cores, that is, with other work on it)."
    )


def _engine(found: dict) -> str:
    rows = []
    for n in WORKERS:
        none, tenth = found[f"nothing_{n}"], found[f"tenth_{n}"]
        share = tenth["per_s"] / (n / tenth["task_s"])
        rows.append([str(n), f"{none['per_s']:.0f}", f"{tenth['per_s']:.1f}", f"{100 * share:.0f} %"])
    heads = ["workers", "empty tasks per s", "tasks of 0.1 s per s", "of the ideal"]
    client_s = min(found[f"nothing_{n}"]["client_s"] for n in WORKERS)
    most = max(found[f"nothing_{n}"]["per_s"] for n in WORKERS)
    return table(heads, rows) + (
        f"\n\nA task of {found['bytes_sent'] / 1e3:.1f} kB goes out and a result of "
        f"{found['bytes_back'] / 1e3:.0f} kB "
        f"comes back. The command itself takes {1e3 * client_s:.1f} ms of processor time for each "
        "measurement (its "
        f"scheduler, reading and writing files), at most {most:.0f} per second here (load "
        f"{found['load']:.1f} on 2 "
        f"cores). By that, {most:.0f} measurements per second is where it saturates: 1000 workers are busy "
        "if a "
        f"measurement takes more than {1000 / most:.0f} s, as a fit with many points or a diagnosis does; "
        "with fits of "
        f"1 s about {most:.0f} workers are. This is computed from the rate, not measured with 1000 workers."
    )


def _many(found: dict) -> str:
    ends = ", ".join(f"{n} `{code}`" for code, n in found["outcomes"].items())
    return (
        f"{found['sheets']} rows ({ends}), {found['per_s']:.2f} per second, "
        f"{1e3 * found['fit_s']:.0f} ms each (load {found['load']:.1f} on 2 cores)."
    )


def _remote(found: dict) -> str:
    ends = ", ".join(f"{n} `{code}`" for code, n in found["outcomes"].items())
    return (
        f"`{found['command']}` with a scheduler and two workers, each a process of its own started by "
        "`dask scheduler` "
        f"and `dask worker`; {found['killed_workers']} worker was killed in the middle: {ends}; exit code "
        f"{found['exit_code']}."
    )


_PARTS = {
    "troubles": _troubles,
    "kills": _kills,
    "overhead": _overhead,
    "unstated_noise": _unstated,
    "first_results": _first,
    "scaling": _scaling,
    "engine": _engine,
    "many_fits": _many,
    "remote": _remote,
}
