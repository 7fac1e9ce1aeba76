"""The process of a worker: limits, deaths, and that its worker survives them."""

import os
import signal
import subprocess
import sys
import time

import pytest

from jaxink.batches.child import Child, EndedError, ProcessLimits
from jaxink.batches.plan import load_plan
from jaxink.batches.row import RowOutcome
from jaxink.batches.task import task_of

FUNCTION = "tests.batches.functions:with_faults"


@pytest.fixture
def task(folder):
    plan = load_plan(folder / "plan.toml")

    def of(content):
        (folder / "sheet_1.csv").write_text(content)
        return task_of(plan.measurements[0], plan)

    return of


@pytest.fixture
def child():
    child = Child(ProcessLimits(20.0, 0.5), FUNCTION)
    yield child
    child.close()


def value(done):
    return done.row.parameters[0].value


def test_one_process_answers_task_after_task_and_what_it_prints_is_lost(child, task):
    assert [value(child.ask(task(text))[0]) for text in ("1", "print", "2")] == [1.0, 8.0, 2.0]


def test_what_kills_its_process_is_tried_twice_and_the_next_task_is_answered(child, task):
    with pytest.raises(EndedError) as caught:
        child.ask(task("die"))
    assert (caught.value.outcome, caught.value.attempts) == (RowOutcome.KILLED, 2)
    done, attempts = child.ask(task("3"))
    assert (value(done), attempts) == (3.0, 1)


def test_what_is_killed_once_has_its_result(child, task):
    done, attempts = child.ask(task("die once"))
    assert (value(done), attempts) == (7.0, 2)


def test_too_much_memory_ends_it(child, task):
    with pytest.raises(EndedError) as caught:
        child.ask(task("eat"))
    assert (caught.value.outcome, caught.value.attempts) == (RowOutcome.MEMORY_LIMIT, 1)


def test_a_hang_ends_at_the_limit_of_time(task):
    child = Child(ProcessLimits(3.0), FUNCTION)
    try:
        assert value(child.ask(task("1"))[0]) == 1.0
        start = time.monotonic()
        with pytest.raises(EndedError) as caught:
            child.ask(task("hang"))
        # A process that has answered before is not given a second time.
        assert (caught.value.outcome, caught.value.attempts) == (RowOutcome.TIME_LIMIT, 1)
        assert time.monotonic() - start >= 3.0
        with pytest.raises(EndedError) as caught:
            child.ask(task("hang"))
        assert (caught.value.outcome, caught.value.attempts) == (RowOutcome.TIME_LIMIT, 2)
    finally:
        child.close()


ORPHAN = """
import sys
from jaxink.batches.child import Child, ProcessLimits
child = Child(ProcessLimits(9.0), "tests.batches.functions:with_faults")
child.start()
print(child._process.pid, flush=True)
sys.stdin.read()
"""


@pytest.mark.skipif(os.name != "posix", reason="signals and process ids of POSIX")
def test_the_process_ends_with_a_worker_that_is_killed():
    worker = subprocess.Popen([sys.executable, "-c", ORPHAN], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    pid = int(worker.stdout.readline())
    worker.kill()
    worker.communicate()
    until = time.monotonic() + 15
    while time.monotonic() < until:
        try:
            os.kill(pid, 0)
        except ProcessLookupError:
            return
        time.sleep(0.05)
    os.kill(pid, signal.SIGKILL)
    pytest.fail("it has outlived its worker")
