"""A Dask scheduler dies in the middle: what was not answered has no row, and the same command does it."""

import os
import subprocess
import sys
from contextlib import contextmanager

import pandas
import pytest

import jaxink
from jaxink.batches import UnfinishedBatchError
from tests.samples import GOOD_SAMPLE

PLAN = 'schema_version = 1\nsample = "sample.toml"\n[measurements]\nfiles = "*.csv"\n'
SLOWLY, AT_ONCE = "tests.batches.functions:slowly", "tests.batches.functions:answered"
# It ends in an orderly way when its input does, and is killed otherwise.
CLUSTER = """
import sys
from distributed import LocalCluster
options = {"n_workers": 2, "threads_per_worker": 1, "processes": False, "protocol": "tcp"}
with LocalCluster(dashboard_address="127.0.0.1:0", **options) as cluster:
    print(cluster.scheduler_address, flush=True)
    sys.stdin.read()
"""
N_SHEETS, N_ANSWERED = 40, 3


@contextmanager
def scheduler():
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with subprocess.Popen([sys.executable, "-c", CLUSTER], env=environment, text=True, **pipes) as process:
        try:
            yield process, process.stdout.readline().strip()
        finally:
            process.kill()


@pytest.mark.parametrize("end", ["killed", "closed"])
def test_what_was_not_answered_is_not_lost(end, tmp_path, told):
    (tmp_path / "plan.toml").write_text(PLAN)
    (tmp_path / "sample.toml").write_text(GOOD_SAMPLE)
    for number in range(N_SHEETS):
        (tmp_path / f"sheet_{number:02}.csv").write_text(str(number))
    plan, out = tmp_path / "plan.toml", tmp_path / "out"
    # Behind what is sent at first, a row that is there already.
    (tmp_path / "last.toml").write_text(PLAN.replace("*.csv", f"sheet_{N_SHEETS - 1}.csv"))
    jaxink.batch(tmp_path / "last.toml", out, workers=0, function=AT_ONCE)

    with scheduler() as (process, address):

        def follow(row, n_done, n_all):
            if n_done == N_ANSWERED:
                process.kill() if end == "killed" else process.stdin.close()

        with pytest.raises(UnfinishedBatchError) as caught:
            jaxink.batch(plan, out, scheduler=address, function=SLOWLY, follow=follow)
    told(str(caught.value), f"of {N_SHEETS} measurements", str(out), numbers=False)

    found, kept = caught.value.found, {file.stem for file in (out / "rows").iterdir()}
    assert N_ANSWERED < len(kept) < N_SHEETS
    assert {row.name for row in found} == kept
    assert found.outcomes == {"done": len(kept)}
    assert found.missing == N_SHEETS - len(kept)
    assert set(pandas.read_csv(out / "summary.csv")["name"]) == kept
    assert f"{found.missing} measurements have no row yet" in (out / "report.html").read_text("utf-8")

    again = jaxink.batch(plan, out, workers=0, function=AT_ONCE)
    assert (again.kept, again.missing) == (len(kept), 0)
    assert {row.parameters[0].value for row in again} == {float(number) for number in range(N_SHEETS)}
