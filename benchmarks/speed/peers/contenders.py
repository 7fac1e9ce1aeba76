"""Who takes part in which work unit, and with which sizes; sizes of jaxink are in this file only."""

from dataclasses import dataclass

THREADS = 2
ONE_THREAD = "one BLAS thread, quicker than two"


@dataclass(frozen=True)
class Contender:
    """One way to do a unit.

    Parameters
    ----------
    name
        As printed.
    package
        Whose version is printed.
    function
        ``module:function`` of this package; makes a run from a unit and a size.
    sizes
        Tried in this order until one passes; streams for discrete ordinates, (escaping, trapped, moments,
        orders) for jaxink.
    note
        What it gives, where that is not the whole unit.
    reference
        Whether its results are what the others of the unit are checked with.
    timed
        False where it only makes the reference.
    counts
        Whether it can be the best peer.
    threads
        Threads of its process. OpenBLAS splits the small matrices of numpy solvers over threads that wait for
        each other, so those get one, which is quicker.
    """

    name: str
    package: str
    function: str
    sizes: tuple = (None,)
    note: str = ""
    reference: bool = False
    timed: bool = True
    counts: bool = True
    threads: int = THREADS

    @property
    def is_peer(self) -> bool:
        """Whether jaxink is measured against it."""
        return self.package != "jaxink" and self.counts


def _jaxink(name, function, sizes=(None,), note="", **more):
    return Contender(name, "jaxink", f"ours:{function}", sizes, note, **more)


LIGHT_STREAMS, DENSE_STREAMS = (16, 20, 24, 28, 32), (32, 40, 48, 56)
NORMAL_SIZES = ((10, 12, 20, 1), (12, 12, 24, 1), (14, 12, 28, 1), (16, 12, 32, 1), (20, 12, 40, 1))
DENSE_SIZES = (
    (20, 12, 40, 16),
    (22, 12, 44, 16),
    (24, 12, 48, 16),
    (26, 12, 52, 18),
    (28, 12, 56, 24),
    (32, 12, 64, 32),
)
REFRACTING_SIZES = (
    (6, 6, 12, 4),
    (8, 8, 16, 6),
    (10, 10, 20, 8),
    (12, 12, 24, 8),
    (16, 12, 32, 12),
    (24, 16, 48, 16),
)
SAMPLE_SIZES = ((8, 8, 16, 6), (10, 10, 20, 8), (12, 12, 24, 8), (16, 12, 32, 12))
# What a user gets who sets no sizes, and much finer ones to check with.
SAMPLE_DEFAULT, SAMPLE_REFERENCE = ((16, 12, 32, 12),), ((32, 24, 64, 24),)

NO_BATCH = "a new solver for every thickness"
REFLECTED = "reflected side only"
TOTALS = "totals R and T at normal incidence only"


def _nanodisort(sizes, note=""):
    return Contender("nanodisort, delta-M + NT", "nanodisort", "cdisort:nanodisort", sizes, note)


def _nanodisort_batch(sizes, note="2 threads"):
    return Contender("nanodisort, batch solver", "nanodisort", "cdisort:nanodisort_batch", sizes, note)


def _pydisort(sizes, note=NO_BATCH):
    return Contender("pydisort, delta-M + NT", "pydisort", "cdisort:pydisort", sizes, note)


def _pythonic(sizes):
    return Contender(
        "PythonicDISORT, NT",
        "PythonicDISORT",
        "pythonic_disort:pythonic_disort",
        sizes,
        ONE_THREAD,
        threads=1,
    )


def _sasktran2(sizes, name="sasktran2, delta-M", function="sasktran2"):
    return Contender(name, "sasktran2", f"sasktran:{function}", sizes, REFLECTED)


def _refracting():
    total = "one total only, error is the standard error"
    return (
        Contender(
            "iadpython",
            "iadpython",
            "totals:iadpython",
            (4, 8, 16, 24, 32, 48),
            f"{TOTALS}; {ONE_THREAD}",
            counts=False,
            threads=1,
        ),
        Contender(
            "mitsuba, llvm_ad_mono", "mitsuba", "totals:mitsuba_llvm", (20_000, 200_000), total, counts=False
        ),
        Contender("mitsuba, scalar_rgb", "mitsuba", "totals:mitsuba_scalar", (20_000,), total, counts=False),
        _jaxink("jaxink", "slab", REFRACTING_SIZES),
    )


CONTENDERS = {
    "W1": (
        _nanodisort(LIGHT_STREAMS),
        _pydisort(LIGHT_STREAMS),
        _pythonic((16, 24, 32, 40, 48)),
        _sasktran2((16, 20, 24, 28, 32)),
        _jaxink("jaxink", "slab", NORMAL_SIZES),
    ),
    "W1 x 64": (
        _nanodisort(LIGHT_STREAMS, "one after the other"),
        _nanodisort_batch(LIGHT_STREAMS),
        _pydisort(LIGHT_STREAMS),
        _jaxink("jaxink, vmap", "slab", NORMAL_SIZES),
    ),
    "W2": (
        _nanodisort(DENSE_STREAMS),
        _pydisort(DENSE_STREAMS),
        _pythonic((64, 96, 128)),
        _sasktran2((48, 56, 64, 80)),
        _jaxink("jaxink", "slab", DENSE_SIZES),
    ),
    "W3a": _refracting(),
    "W3b": _refracting(),
    "W4": (
        Contender(
            "nanodisort, central differences",
            "nanodisort",
            "cdisort:central_differences",
            (96,),
            reference=True,
            timed=False,
        ),
        _nanodisort(DENSE_STREAMS, "forward differences, 4 solves"),
        _nanodisort_batch(DENSE_STREAMS, "forward differences, 4 solves in one batch, 2 threads"),
        _pydisort(DENSE_STREAMS, "forward differences, 4 solves"),
        _sasktran2((48, 56, 64, 80), "sasktran2, analytic", "sasktran2_linearised"),
        _jaxink("jaxink, value and Jacobian", "slab_with_jacobian", DENSE_SIZES),
        _jaxink("jaxink, value only", "slab", DENSE_SIZES),
    ),
    "W5": (
        Contender("miepython, numba", "miepython", "spheres:miepython", reference=True),
        Contender("sasktran2.mie", "sasktran2", "spheres:sasktran2"),
        _jaxink("jaxink", "spheres"),
        _jaxink("jaxink, with derivatives", "spheres_with_jacobian", note="size parameter, n and k"),
    ),
    "W6": (
        _nanodisort(DENSE_STREAMS, "one after the other"),
        _nanodisort_batch(DENSE_STREAMS),
        _pydisort(DENSE_STREAMS),
        _sasktran2((64,)),
        _jaxink("jaxink, vmap", "slab", DENSE_SIZES),
    ),
    "whole sample": (
        _jaxink("jaxink, fine", "sample", SAMPLE_REFERENCE, reference=True, timed=False),
        _jaxink("jaxink, value and Jacobian", "sample_with_jacobian", SAMPLE_SIZES),
        _jaxink("jaxink, default sizes", "sample_with_jacobian", SAMPLE_DEFAULT, "value and Jacobian"),
        _jaxink("jaxink, value only", "sample", SAMPLE_SIZES),
    ),
}
