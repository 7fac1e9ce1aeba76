"""Progress in a log: a line at each task and now and then, but not one for each step."""

import time

import pytest

from jaxink.cli import session
from jaxink.cli.progress_lines import ProgressLines


class Clock:
    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


def lines_of(steps):
    """Lines written for (seconds passed, task, step)."""
    lines, clock = [], Clock()
    with ProgressLines(lines.append, clock) as follow:
        for seconds, what, step in steps:
            clock.now += seconds
            follow(what, step, 12.5)
    return lines


def test_a_new_task_is_named_at_once():
    lines = lines_of([(0.1, "start 1", 1), (0.1, "start 1", 2), (0.1, "profile", 1)])
    assert [line.split("  ")[-1].split(":")[0] for line in lines] == ["start 1", "profile"]


def test_steps_of_a_task_are_thinned():
    lines = lines_of([(0.1, "start 1", step) for step in range(1, 201)])
    # 20 s: the first, and one every 5 s.
    assert 4 <= len(lines) <= 5
    assert all("misfit 12.5" in line for line in lines)


@pytest.mark.parametrize("task", ["refit with effect", "input check, times_pi"])
def test_many_refits_of_one_kind_are_one_task(task):
    assert len(lines_of([(0.01, f"{task}_{i}", 1) for i in range(40)])) == 1


def test_a_task_without_steps_is_said_to_run():
    lines = []
    with ProgressLines(lines.append, silence_s=0.05) as follow:
        follow("screen", 1, 3.0)
        deadline = time.monotonic() + 20
        while not any("screen: still running" in line for line in lines) and time.monotonic() < deadline:
            time.sleep(0.01)
    assert any("screen: still running" in line for line in lines)
    # Nothing is written afterwards.
    assert not follow._watch.is_alive()


def test_without_a_terminal_there_are_lines_unless_quiet(capsys):
    with session.progress(quiet=True) as follow:
        assert follow is None
    with session.progress() as follow:
        follow("start 1", 1, 5.0)
    captured = capsys.readouterr()
    assert captured.out == ""
    assert "start 1: step 1, misfit 5" in captured.err
