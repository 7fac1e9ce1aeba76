"""Programs in memory, of which those used least recently are dropped first.

A compiled program takes tens of megabytes, and hundreds of the memory mappings of which a Linux process may
have 65530. Each of JAX's own functions that is called outside of them, such as an addition, is a program of
over a megabyte, too, for every shape of its arguments; those are dropped from time to time.
"""

import ctypes
import gc
import threading
import weakref
from collections import OrderedDict
from collections.abc import Hashable
from contextlib import suppress
from typing import Any, Protocol, runtime_checkable

import jax

# A diagnosis loads about sixteen.
_MOST = 24
# As many programs are dropped before JAX's own functions are, about once in a diagnosis.
_DROPS = 12


@runtime_checkable
class Owner(Protocol):
    """What holds programs."""

    def drop(self, name: Hashable) -> None:
        """Forget a program; it is loaded again when it is needed."""


class LoadedPrograms:
    """Programs in the order of their last use.

    Parameters
    ----------
    most
        Number beyond which those used least recently are dropped.
    drops
        Number of programs dropped after which JAX's own functions are dropped as well.
    """

    def __init__(self, most: int = _MOST, drops: int = _DROPS):
        self._most, self._drops, self._dropped = most, drops, 0
        self._used: OrderedDict[tuple, weakref.ref[Owner]] = OrderedDict()
        self._lock = threading.Lock()

    def use(self, owner: Owner, name: Hashable) -> None:
        """Take note of the use of a program that an object owns."""
        with self._lock:
            self._used[id(owner), name] = weakref.ref(owner)
            self._used.move_to_end((id(owner), name))
            is_full = len(self._used) > self._most
        if is_full and self.drop_oldest():
            self._dropped += 1
            if self._dropped % self._drops == 0:
                _drop_small_programs()
            _return_freed_memory()

    def drop_oldest(self) -> bool:
        """Drop the program used least recently; return whether there was one."""
        with self._lock:
            if not self._used:
                return False
            (_, name), reference = self._used.popitem(last=False)
        owner = reference()
        if owner is not None:
            owner.drop(name)
        return True


LOADED = LoadedPrograms()


def _drop_small_programs() -> None:
    """Drop the programs of JAX's own functions, for all shapes; a user's compiled functions keep theirs.

    JAX compiles them again, or loads them from the store, which takes milliseconds each.
    """
    jitted: Any = type(jax.jit(abs))
    for function in gc.get_objects():
        if type(function) is jitted and str(getattr(function, "__module__", "")).split(".")[0] == "jax":
            function.clear_cache()


def _return_freed_memory() -> None:
    """Return to the system what the C library keeps of freed memory, if it is the one that can."""
    with suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)
