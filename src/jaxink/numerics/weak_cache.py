"""Cache of expensive objects that are kept only while in use.

A compiled program takes hundreds to thousands of memory mappings, of which a Linux process may have 65530.
"""

import threading
from collections import deque
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar
from weakref import WeakValueDictionary

_RECENT = 24

Made = TypeVar("Made")


class WeakCache(Generic[Made]):
    """Makes one object per key by calling ``make(*key)``; keeps those in use and the most recent ones."""

    def __init__(self, make: Callable[..., Made]):
        self._make = make
        self._alive: WeakValueDictionary[Hashable, Made] = WeakValueDictionary()
        self._recent: deque[Made] = deque(maxlen=_RECENT)
        self._lock = threading.Lock()

    def __call__(self, *key: Hashable) -> Made:
        """The object for a key."""
        with self._lock:
            found = self._alive.get(key)
            if found is None:
                found = self._alive[key] = self._make(*key)
            if not any(found is one for one in self._recent):
                self._recent.append(found)
            return found
