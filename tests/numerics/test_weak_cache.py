"""Costly things are made once while somebody holds them, and forgotten afterwards."""

import gc

from jaxink.numerics.weak_cache import WeakCache


class Thing:
    def __init__(self, *key):
        self.key = key


def alive():
    gc.collect()
    return {one.key for one in gc.get_objects() if isinstance(one, Thing)}


def test_a_thing_is_made_once_while_it_is_held():
    made = WeakCache(Thing)
    held = made("a", 1)
    for i in range(20):
        made("other", i)
    assert made("a", 1) is held
    assert made("a", 2) is not held


def test_things_that_nobody_holds_are_forgotten_but_for_the_last_few():
    made = WeakCache(Thing)
    keys = [made("thing", i).key for i in range(50)]
    assert alive() == set(keys[-24:])
