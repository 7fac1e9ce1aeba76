"""Work on programs that are compiled at the same time."""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from jaxink.numerics.precision import computing

# Programs that are compiled at a time.
_COMPILING = 2
Item = TypeVar("Item")
Result = TypeVar("Result")


def in_threads(work: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """Work on items of different programs, two at a time: most of it is compiling."""

    def guarded(item: Item) -> Result:
        with computing():
            return work(item)

    with ThreadPoolExecutor(_COMPILING) as pool:
        return list(pool.map(guarded, items))
