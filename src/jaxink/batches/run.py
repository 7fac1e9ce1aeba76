"""A batch: what is left to do, done by this process or by Dask, and kept as it ends."""

import os
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import ExitStack, closing
from pathlib import Path

from jaxink.batches.child import MEASURE, MOST_TRIES, ProcessLimits
from jaxink.batches.child_main import named
from jaxink.batches.folder import BatchFolder, Done, trouble
from jaxink.batches.on_dask import LostSchedulerError, local_client, measured_by, remote_client
from jaxink.batches.page import write_batch
from jaxink.batches.plan import Plan, load_plan
from jaxink.batches.result import Batch, UnfinishedBatchError
from jaxink.batches.row import ABSENT, Row, RowOutcome
from jaxink.batches.task import Absent, MeasurementTask, Unreadable, task_of
from jaxink.errors import InputRefusedError, require_integer

# Called with a row, the number of measurements that have one, and the number of all.
Follow = Callable[[Row, int, int], None]
_MEMORY_SHARE = 0.9
_GIB = 2**30


def batch(
    plan: Plan | str | Path,
    out: str | Path,
    workers: int | None = None,
    scheduler: str | None = None,
    devices: Sequence[str] = (),
    retry: bool = False,
    follow: Follow | None = None,
    function: str = MEASURE,
) -> Batch:
    """Fit or diagnose many measurements; what has been done with the same inputs is not done again.

    Parameters
    ----------
    plan
        What is to be done, or its file.
    out
        Folder for a row and a folder of each measurement, and for the summary; created if it does not exist.
    workers
        Number of processes that work at the same time on this machine; 0: this process does everything, one
        measurement after the other, within no limits; None: one for each core.
    scheduler
        Address of a Dask scheduler that runs, whose workers do the work instead.
    devices
        Graphics processors that the workers on this machine share out, as in ``CUDA_VISIBLE_DEVICES``.
    retry
        Whether to do again what was ended by a limit or failed unexpectedly.
    follow
        Called with each row as it is written, the number of measurements that have one, and the number of
        all.
    function
        What is called with each task, as ``module:function``.

    Raises
    ------
    InputRefusedError
        If the plan is invalid, the folder cannot be written or is in use, or there is no such scheduler.
    UnfinishedBatchError
        If the scheduler was lost; the summary of what there is has been written.
    """
    if workers is not None:
        require_integer("workers", workers, 0, 10_000)
        if scheduler is not None:
            raise InputRefusedError(
                "workers and scheduler are both given; a scheduler has its own workers, so leave out one."
            )
    plan = plan if isinstance(plan, Plan) else load_plan(plan)
    folder = BatchFolder(out)
    with folder.locked():
        listing, lost = _Listing(plan, folder, retry), ""
        left, n_all = listing.left(), len(plan.measurements)
        # Closed at once if this is interrupted, so that no process of a worker remains.
        try:
            with closing(_answers(listing, left, workers, scheduler, devices, function)) as answers:
                for done in answers:
                    if listing.keeps_result_despite(done.row):
                        continue
                    if done.row.inputs.measurement == ABSENT:
                        folder.write_row(done.row)
                    else:
                        folder.write(done)
                    listing.rows[done.row.name] = done.row
                    if follow is not None:
                        follow(done.row, len(listing.rows), n_all)
        except LostSchedulerError as problem:
            lost = str(problem)
            # Rows that are there, behind what was sent.
            for _ in left:
                pass
        found = listing.batch()
        write_batch(found)
        if lost:
            raise UnfinishedBatchError(lost, found)
        return found


class _Listing:
    """What is there, and what is left to do; files are read only when their turn comes."""

    def __init__(self, plan: Plan, folder: BatchFolder, retry: bool):
        self.plan, self.folder, self._retry = plan, folder, retry
        self.rows: dict[str, Row] = {}
        # Why a row that is there is done again, by its name.
        self.again: dict[str, str] = {}
        self.absent: dict[str, str] = {}
        self.kept = 0

    def left(self) -> Iterator[MeasurementTask | Unreadable]:
        """What has no row of the same inputs; those whose process ended without one come last."""
        tries = self.folder.tries()
        for one in sorted(self.plan.measurements, key=lambda one: tries.get(one.name, 0)):
            task, row = task_of(one, self.plan), self.folder.row(one.name)
            if row is not None:
                changed = task.inputs.changed_since(row.inputs)
                if isinstance(task, Absent) and row.ended.has_result:
                    self._keep(row, task.sentence, "missing", changed)
                    continue
                if isinstance(task, Absent):
                    # There is nothing to lose, and its sentence is that of now.
                    yield task
                    continue
                if not changed and not (self._retry and row.ended.depends_on_machine):
                    self.rows[one.name] = row
                    self.kept += 1
                    continue
                why = " and ".join(changed) if changed else f"it ended with {row.outcome}"
                self.again[one.name] = f"{one.name} is done again: {why}."
            yield task

    def keeps_result_despite(self, answer: Row) -> bool:
        """Whether an input that is refused now leaves an earlier result, which is then listed."""
        earlier = self.folder.row(answer.name) if answer.ended is RowOutcome.REFUSED else None
        if earlier is None or not earlier.ended.has_result:
            return False
        self._keep(earlier, answer.sentence, "refused", answer.inputs.changed_since(earlier.inputs))
        self.again.pop(answer.name, None)
        return True

    def _keep(self, earlier: Row, sentence: str, trouble: str, changed: Sequence[str]) -> None:
        """List an earlier result whose input is of no use now, and what it rests on."""
        but = f", although {' and '.join(changed)} since" if changed else ""
        self.absent[earlier.name] = (
            f"{sentence.removesuffix('.')}; input {trouble} now, so the earlier result is kept{but}."
        )
        self.rows[earlier.name] = earlier

    def batch(self) -> Batch:
        """What has a row now."""
        plan = self.plan
        listed = tuple(one for one in plan.measurements if one.name in self.rows)
        return Batch(
            title=plan.title,
            rows=tuple(self.rows[one.name] for one in listed),
            measurements=listed,
            folder=self.folder.path,
            kept=self.kept,
            again=tuple(self.again.values()),
            absent=self.absent,
            others=len(self.folder.names() - {one.name for one in plan.measurements}),
            reading=plan.reading,
            missing=len(plan.measurements) - len(listed),
        )


def _answers(
    listing: _Listing,
    left: Iterator[MeasurementTask | Unreadable],
    workers: int | None,
    scheduler: str | None,
    devices: Sequence[str],
    function: str,
) -> Generator[Done, None, None]:
    tasks, refused = _Readable(left), RowOutcome.REFUSED
    plan = listing.plan
    with ExitStack() as stack:
        if workers == 0:
            answers = _in_order(tasks, listing.folder, function)
        else:
            n_workers = workers or _n_cores()
            limits = ProcessLimits(plan.seconds, plan.memory_gib)
            if scheduler is None:
                limits = ProcessLimits(plan.seconds, plan.memory_gib or _memory_gib(n_workers))
                first = tasks.peek()
                client = stack.enter_context(local_client(n_workers)) if first else None
            else:
                client = stack.enter_context(remote_client(scheduler))
            answers = iter(()) if client is None else measured_by(client, tasks, limits, function, devices)
        for done in answers:
            yield from (trouble(each, refused, each.sentence) for each in tasks.unreadable())
            yield done
        yield from (trouble(each, refused, each.sentence) for each in tasks.unreadable())


class _Readable(Iterator[MeasurementTask]):
    """The tasks that can travel; the others wait until they are asked for."""

    def __init__(self, tasks: Iterator[MeasurementTask | Unreadable]):
        self._tasks, self._unreadable = tasks, list[Unreadable]()
        self._first: list[MeasurementTask] = []

    def __next__(self) -> MeasurementTask:
        if self._first:
            return self._first.pop()
        for task in self._tasks:
            if isinstance(task, MeasurementTask):
                return task
            self._unreadable.append(task)
        raise StopIteration

    def peek(self) -> bool:
        """Whether there is a task."""
        self._first += [task for task in [next(self, None)] if task is not None]
        return bool(self._first)

    def unreadable(self) -> Iterator[Unreadable]:
        """What was passed over since the last call."""
        passed, self._unreadable = self._unreadable, []
        return iter(passed)


def _in_order(tasks: Iterator[MeasurementTask], folder: BatchFolder, function: str) -> Iterator[Done]:
    """One after the other in this process; one that ends it twice is not begun a third time."""
    measure = named(function)
    tries = folder.tries()
    for task in tasks:
        count = tries.pop(task.name, 0)
        if count >= MOST_TRIES:
            sentence = (
                f"this process ended while it worked on it, {count} times; take --workers 1 for its limits."
            )
            yield trouble(task, RowOutcome.KILLED, sentence, attempts=count)
            folder.note_tries(tries)
            continue
        folder.note_tries(tries | {task.name: count + 1})
        try:
            yield measure(task)
        except BaseException:
            # An interruption, here or where the answer is written, says nothing about the measurement.
            folder.note_tries(tries | ({task.name: count} if count else {}))
            raise
    folder.note_tries(tries)


def _n_cores() -> int:
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1


def _memory_gib(n_workers: int) -> float | None:
    """The machine's memory for each of some workers; None if it is unknown."""
    try:
        return _MEMORY_SHARE * os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / _GIB / n_workers
    except (AttributeError, ValueError, OSError):
        return None
