"""Work in threads, of which most of the time is compilation: XLA compiles without Python's lock."""

from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from jaxink.numerics.precision import computing

_AT_ONCE = 2
Item = TypeVar("Item")
Result = TypeVar("Result")


def in_threads(work: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """Work on items that need different programs, two at a time; see `computing`."""

    def guarded(item: Item) -> Result:
        with computing():
            return work(item)

    with ThreadPoolExecutor(_AT_ONCE) as pool:
        return list(pool.map(guarded, items))
