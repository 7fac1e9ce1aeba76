"""Progress in a log: a line at each task and now and then, but not one for each step."""

import io
import time

import pytest
from rich.console import Console

from jaxink.cli import session
from jaxink.cli.progress_bar import ProgressBar
from jaxink.cli.progress_lines import ProgressLines
from jaxink.numerics.progress import StepOf


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


@pytest.mark.parametrize(
    "task", ["refit with effect", "input check, times_pi", "profile of ink.scattering_per_mm@500"]
)
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


def test_a_step_of_a_known_total_says_so():
    lines = lines_of([(0.1, "refit with stray_light", StepOf(3, 12))])
    assert "refit with stray_light: step 3 of 12, misfit 12.5" in lines[0]
    assert StepOf(3, 12) == 3


def shown_by_bar(*steps):
    """What a terminal of 120 columns shows after some steps."""
    to = Console(file=io.StringIO(), force_terminal=True, width=120, color_system=None)
    with ProgressBar(to) as bar:
        for step in steps:
            bar(*step)
        bar._bars.refresh()
        return to.file.getvalue().splitlines()[-1]


def test_a_bar_shows_task_step_misfit_and_time():
    line = shown_by_bar(("screen", 1, 800.0), ("held out with gain", StepOf(6, 12), 12.5))
    assert "held out with gain" in line
    assert "step 6 of 12, misfit 12.5" in line
    assert "0:00:0" in line


def test_a_bar_is_as_full_as_the_task_is_far():
    def share(line):
        return line.count("\N{BOX DRAWINGS HEAVY HORIZONTAL}")

    at = [share(shown_by_bar(("refit with gain", StepOf(number, 12), 1.0))) for number in (1, 6, 12)]
    assert at[0] < at[1] < at[2]
    # A task without a total after one with a total only pulses.
    assert "step 4, misfit 1" in shown_by_bar(("refit with gain", StepOf(1, 2), 1.0), ("start 1", 4, 1.0))
