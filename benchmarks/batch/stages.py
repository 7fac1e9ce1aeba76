"""The stages of the benchmark; each returns what the page says of it."""

import csv
import dataclasses
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

import jaxink
from benchmarks.batch.sheets import ACCURACY, FREE, TROUBLES, truths, write_sheets
from benchmarks.simulated_data import data_file, declared_text
from jaxink.measurement import Noise

SHEETS, KILLS, GOOD, MANY = 200, 10, 40, 120
UNSTATED = 20
WORKERS = (1, 2, 4, 8)
FAULTS = "benchmarks.batch.faults:measure_with_faults"
LIMITS = "seconds = 60\nmemory_gib = 1.5"
EQUAL = 1e-8
RUN = "import sys, jaxink; jaxink.batch(*sys.argv[1:3], workers=2, function=sys.argv[3])"


def _sheets(work: Path) -> Path:
    return write_sheets(work / "sheets", SHEETS, TROUBLES, limits=LIMITS)


def _rows(out: Path) -> dict[str, dict[str, str]]:
    with open(out / "summary.csv", encoding="utf-8", newline="") as file:
        return {row["name"]: row for row in csv.DictReader(file)}


def troubles(work: Path) -> dict:
    """All sheets by two workers: outcome of each trouble, and the parameters of the good sheets."""
    plan, out = _sheets(work), work / "undisturbed"
    start = time.monotonic()
    jaxink.batch(plan, out, workers=2, function=FAULTS)
    rows = _rows(out)
    kinds, names = [], {}
    for i, trouble in enumerate(TROUBLES):
        name = f"sheet_{10 * i + 5:04d}_{trouble.name}"
        names[name] = trouble
        row = rows[name]
        right = row["outcome"] == trouble.outcome and trouble.verdict in (None, row["verdict"])
        sentence = row["sentence"].replace(f"{plan.parent}/", "")
        kinds.append([trouble.name, row["outcome"], row["verdict"], sentence, right])
    good, away = [], []
    for (name, row), truth in zip(rows.items(), truths(SHEETS), strict=True):
        if name not in names:
            good.append(row["outcome"] == "done")
            if good[-1]:
                away += [(float(row[n]) - truth[n]) / float(row[f"{n}_se"]) for n in FREE]
    return {
        "kinds": kinds,
        "good": len(good),
        "good_done": sum(good),
        "verdicts": _counted(row["verdict"] for name, row in rows.items() if name not in names),
        "within_3_se": float(np.mean(np.abs(away) < 3)),
        "wall_s": time.monotonic() - start,
    }


def _counted(words) -> dict[str, int]:
    words = list(words)
    return {word: words.count(word) for word in sorted(set(words))}


def kills(work: Path) -> dict:
    """The same batch, ten times killed at random: a worker's process, or the whole batch."""
    plan, out, random = _sheets(work), work / "killed", np.random.default_rng(25)
    log, done = [], 0
    process = _begun(plan, out)
    for number in range(KILLS):
        # After some further rows, and then at a random moment.
        wanted = done + int(random.integers(6, 20))
        while process.poll() is None and (done := _n_rows(out)) < wanted:
            time.sleep(0.02)
        time.sleep(float(random.uniform(0, 1)))
        if process.poll() is not None:
            break
        if number % 2:
            process.send_signal(signal.SIGKILL)
            process.wait()
            log.append(["the whole batch", _n_rows(out)])
            process = _begun(plan, out)
        else:
            workers = _children(process.pid)
            if workers:
                os.kill(int(random.choice(workers)), signal.SIGKILL)
            log.append(["a worker", _n_rows(out)])
    code = process.wait()
    time.sleep(3)
    mine, theirs = _rows(out), _rows(work / "undisturbed")
    numbers = [
        abs(float(mine[name][key]) / float(theirs[name][key]) - 1)
        for name in theirs
        for key in (*FREE, *(f"{n}_se" for n in FREE), "reduced_chi_square")
        if theirs[name][key] and mine[name][key]
    ]
    same = all(
        mine[name][key] == theirs[name][key] for name in theirs for key in ("outcome", "verdict", "sentence")
    )
    return {
        "log": log,
        "exit_code": code,
        "rows": len(mine),
        "row_files": _n_rows(out),
        "result_folders": len(list((out / "results").iterdir())),
        "left_over": [entry.name for entry in out.rglob(".jaxink-*")],
        "largest_difference": max(numbers),
        "equal": max(numbers) < EQUAL,
        "same_words": same,
        "processes_left": _running(),
    }


def _begun(plan: Path, out: Path) -> subprocess.Popen:
    return subprocess.Popen([sys.executable, "-c", RUN, str(plan), str(out), FAULTS])


def _n_rows(out: Path) -> int:
    return len(list((out / "rows").glob("*.json"))) if (out / "rows").exists() else 0


def _children(pid: int) -> list[int]:
    found = []
    for task in Path(f"/proc/{pid}/task").iterdir():
        try:
            found += map(int, (task / "children").read_text().split())
        except OSError:
            continue
    return sorted(set(found))


def _command_line(pid: int) -> bytes:
    try:
        return Path(f"/proc/{pid}/cmdline").read_bytes()
    except OSError:
        return b""


def _running() -> int:
    """Processes of workers that have outlived their batch: those without a parent."""
    found = 0
    for entry in Path("/proc").iterdir():
        try:
            words = (entry / "cmdline").read_bytes()
            parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
        except (OSError, ValueError, IndexError):
            continue
        found += b"jaxink.batches.child_main" in words and b"measure_with_faults" in words and parent == 1
    return found


def overhead(work: Path) -> dict:
    """Processor time of a batch in this process against a bare loop of the same warm fits."""
    plan = jaxink.load_plan(write_sheets(work / "two_hundred", SHEETS))
    options = jaxink.FitOptions(accuracy=ACCURACY, profile="none")
    files = [one.files[0] for one in plan.measurements]

    def loop(saves: bool) -> float:
        start = time.process_time()
        for file, one in zip(files, plan.measurements, strict=True):
            parameters = plan.sample.parameters
            for name, value in one.values.items():
                parameters = parameters.replace(name, value=value)
            sample = dataclasses.replace(plan.sample, parameters=parameters)
            result = jaxink.fit(file, sample, options)
            if saves:
                result.save(work / "loop" / one.name)
        return (time.process_time() - start) / len(files)

    def batch(number: int) -> float:
        start = time.process_time()
        jaxink.batch(plan, work / f"in_order_{number}_{time.time_ns()}", workers=0)
        return (time.process_time() - start) / len(files)

    loop(False)
    found = {"bare_loop_s": [], "saving_loop_s": [], "batch_s": []}
    for number in range(3):
        found["bare_loop_s"].append(loop(False))
        found["saving_loop_s"].append(loop(True))
        found["batch_s"].append(batch(number))
    seconds = {key: float(np.median(values)) for key, values in found.items()}
    return {**seconds, "sheets": len(files), "runs": 3}


def unstated_noise(_work: Path) -> dict:
    """Warm fits with stated noise, and with noise found from values; scans differ by 2 %."""
    sample = jaxink.parse_sample(declared_text("plain_hg"), "plain_hg")
    sample = dataclasses.replace(sample, noise=Noise())
    options, random = jaxink.FitOptions(accuracy=ACCURACY, profile="none"), np.random.default_rng(3)
    once, stated = jaxink.read(data_file("plain_hg")), []
    for _ in range(UNSTATED + 1):
        factor = 1 + 0.02 * random.standard_normal(len(once.scans))[once.scan_index]
        sigma = 0.004 * once.bsdf_per_sr
        values = once.bsdf_per_sr * factor + sigma * random.standard_normal(len(once))
        stated.append(once.replace(bsdf_per_sr=values, sigma_per_sr=sigma))
    unstated = [data.replace(sigma_per_sr=None) for data in stated]
    found = {}
    for name, sheets in (("stated", stated), ("unstated", unstated)):
        jaxink.fit(sheets[0], sample, options)
        start, began = time.process_time(), time.perf_counter()
        results = [jaxink.fit(data, sample, options) for data in sheets[1:]]
        found[f"{name}_s"] = (time.process_time() - start) / UNSTATED
        searched = sum(result.run_seconds for result in results)
        found[f"{name}_search_share"] = searched / (time.perf_counter() - began)
    noises = {result.noise["scan_relative"] for result in results}
    return {**found, "sheets": UNSTATED, "noises": len(noises)}


def first_results(work: Path) -> dict:
    """Time from the first result to the second, by two workers, with programs stored."""
    plan, times = jaxink.load_plan(write_sheets(work / "good", GOOD)), []
    start = time.monotonic()
    jaxink.batch(
        plan,
        work / f"first_{time.time_ns()}",
        workers=2,
        follow=lambda *_: times.append(time.monotonic() - start),
    )
    return {"first_s": times[0], "second_after_s": times[1] - times[0], "load": os.getloadavg()[0]}


def scaling(work: Path) -> dict:
    """Warm fits per second by one and by two workers, in turns, and the load of the machine meanwhile."""
    plan, found = jaxink.load_plan(write_sheets(work / "two_hundred", SHEETS)), {1: [], 2: []}
    for _ in range(3):
        for n in (1, 2):
            times = []
            jaxink.batch(
                plan,
                work / f"scaling_{time.time_ns()}",
                workers=n,
                follow=lambda *_, times=times: times.append(time.monotonic()),
            )
            # The second half, when every worker has its programs.
            half = times[len(times) // 2 :]
            found[n].append((len(half) - 1) / (half[-1] - half[0]))
    one, two = (float(np.median(found[n])) for n in (1, 2))
    return {"one_per_s": one, "two_per_s": two, "ratio": two / one, "runs": 3, "load": os.getloadavg()[0]}


def engine(work: Path) -> dict:
    """Tasks per second when they do nothing, and with fits of a fixed duration, by numbers of workers."""
    plan = write_sheets(work / "many", MANY)
    found = {}
    for function, seconds in (("nothing", 0.0), ("tenth", 0.1)):
        for n in WORKERS:
            times = []
            process = time.process_time()
            jaxink.batch(
                plan,
                work / f"engine_{time.time_ns()}",
                workers=n,
                function=f"benchmarks.batch.stand_ins:{function}",
                follow=lambda *_, times=times: times.append(time.monotonic()),
            )
            half = times[len(times) // 4 :]
            rate = (len(half) - 1) / (half[-1] - half[0])
            found[f"{function}_{n}"] = {"per_s": rate, "task_s": seconds}
            found[f"{function}_{n}"]["client_s"] = (time.process_time() - process) / len(times)
    import pickle

    from jaxink.batches.plan import load_plan
    from jaxink.batches.task import task_of

    opened = load_plan(plan)
    found["bytes_sent"] = len(pickle.dumps(task_of(opened.measurements[0], opened)))
    folder = sorted((work / "undisturbed" / "results").iterdir())[0]
    found["bytes_back"] = sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())
    found["load"] = os.getloadavg()[0]
    return found


def many_fits(work: Path) -> dict:
    """Two thousand short fits by two workers."""
    plan, times = jaxink.load_plan(write_sheets(work / "thousands", 2000)), []
    start = time.monotonic()
    found = jaxink.batch(
        plan, work / "thousands_out", workers=2, follow=lambda *_: times.append(time.monotonic())
    )
    return {
        "sheets": len(found),
        "outcomes": dict(found.outcomes),
        "done_now": len(times),
        "per_s": len(times) / (time.monotonic() - start),
        "fit_s": float(np.median([row.seconds for row in found])),
        "load": os.getloadavg()[0],
    }


def remote(work: Path) -> dict:
    """A scheduler and two workers in processes of their own, by the commands of the page; one is killed."""
    folder = work / f"remote_{time.time_ns()}"
    folder.mkdir(parents=True)
    write_sheets(work / "good", GOOD)
    address = "tcp://127.0.0.1:18786"
    started = [
        subprocess.Popen(
            [
                sys.executable,
                "-m",
                "dask",
                "scheduler",
                "--host",
                "127.0.0.1",
                "--port",
                "18786",
                "--no-dashboard",
            ],
            cwd=folder,
            stderr=subprocess.DEVNULL,
        )
    ]
    time.sleep(4)
    for _ in range(2):
        command = [sys.executable, "-m", "dask", "worker", address, "--nthreads", "1", "--no-dashboard"]
        started.append(subprocess.Popen(command, cwd=folder, stderr=subprocess.DEVNULL))
    command = [sys.executable, "-m", "jaxink", "batch", str(work / "good" / "plan.toml")]
    command += ["--out", str(folder / "out"), "--scheduler", address]
    try:
        time.sleep(6)
        batch = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        while batch.poll() is None and _n_rows(folder / "out") < 15:
            time.sleep(0.05)
        # The worker itself, not its nanny: what a cluster does when it takes a node away.
        victim = [pid for pid in _children(started[1].pid) if b"spawn_main" in _command_line(pid)]
        if victim:
            os.kill(victim[0], signal.SIGKILL)
        said = batch.communicate(timeout=540)[0]
    finally:
        for process in reversed(started):
            process.terminate()
            process.wait()
    rows = _rows(folder / "out")
    hosts = [row["outcome"] for row in rows.values()]
    return {
        "command": " ".join(["jaxink", *command[3:4], "plan.toml", "--out", "out", "--scheduler", address]),
        "outcomes": _counted(hosts),
        "exit_code": batch.returncode,
        "killed_workers": len(victim[:1]),
        "said": said.splitlines()[:4],
    }
