"""What fails is left out and noted; what is no fault of a part gets through."""

import logging

import numpy as np
import pytest

from jaxink.errors import InputRefusedError, PrecisionError
from jaxink.numerics.failures import Failure, Failures
from jaxink.numerics.threads import in_threads


def test_what_fails_is_noted_once_and_logged_with_its_traceback(caplog):
    failures = Failures()
    with caplog.at_level(logging.DEBUG, "jaxink"):
        for problem in (np.linalg.LinAlgError("SVD did not converge"), ValueError("later")):
            with failures.sparing("the refit with {}", "gain"):
                raise problem
    assert failures.found == (Failure("the refit with gain", "gain", "LinAlgError: SVD did not converge"),)
    assert failures.found[0].sentence == "The refit with gain failed: LinAlgError: SVD did not converge."
    assert failures.names_with("the refit with {}") == {"gain"}
    assert failures.names_with("the screen for {}") == set()
    assert [record.exc_info[0] for record in caplog.records] == [np.linalg.LinAlgError, ValueError]


@pytest.mark.parametrize(
    ("problem", "reason"),
    [
        (MemoryError(), "MemoryError"),
        (InputRefusedError("radius_nm is -1; it must be positive."), "radius_nm is -1; it must be positive."),
        (KeyError("lens"), "KeyError: 'lens'"),
        (
            RuntimeError("INTERNAL: Traceback (most recent call last):\n  File x\nOSError: no lens\n\nmore"),
            "OSError: no lens",
        ),
        (ValueError("two\n  lines"), "ValueError: two lines"),
    ],
)
def test_a_reason_is_one_line(problem, reason):
    failures = Failures()
    with failures.sparing("the refit", ""):
        raise problem
    assert failures.found[0].reason == reason
    with failures.sparing("the screen", ""):
        raise ValueError("no end of words " * 10_000)
    assert len(failures.found[1].reason) < 300


@pytest.mark.parametrize("problem", [KeyboardInterrupt(), SystemExit(1), PrecisionError("32 bits")])
def test_what_is_not_the_fault_of_a_part_gets_through(problem):
    failures = Failures()

    def fail(items):
        raise problem

    with pytest.raises(type(problem)), failures.sparing("the refit", ""):
        fail(())
    with pytest.raises(type(problem)):
        failures.in_parts(fail, [1, 2], "{}")
    assert failures.found == ()


@pytest.mark.parametrize("bad", [(), (0,), (6,), (1, 2), (0, 3, 6), tuple(range(7))])
def test_only_items_that_fail_alone_are_left_out(bad):
    failures, tried = Failures(), []

    def work(items):
        tried.append(len(items))
        if faulty := [item for item in items if item in bad]:
            raise ArithmeticError(faulty)
        return [10 * item for item in items]

    found = failures.in_parts(work, range(7), "number {}")
    assert found == [10 * item for item in range(7) if item not in bad]
    assert {failure.name for failure in failures.found} == set(map(str, bad))
    # Without a fault everything is done at once.
    assert bad or tried == [7]


def test_no_item_is_blamed_for_what_fails_without_any():
    failures = Failures()

    def work(items):
        raise ArithmeticError

    with pytest.raises(ArithmeticError):
        failures.in_parts(work, [1, 2, 3], "{}")
    assert failures.found == ()


def test_threads_may_fail_in_any_order():
    failures = Failures()

    def work(number):
        with failures.sparing("number {}", f"{number:02}"):
            raise ValueError(number)

    in_threads(work, range(20))
    assert [failure.reason for failure in failures.found] == [f"ValueError: {n}" for n in range(20)]
