"""Guards that a solve is made in 64 bits, by a jaxlib that cannot deadlock, at its proper speed."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import jax
import jaxlib

from jaxink.errors import PrecisionError, UnsafeVersionError
from jaxink.numerics.forking import claim_process

_LOG = logging.getLogger("jaxink")

# jaxlib 0.10.0 ... 0.11.0 splits batched LAPACK calls over XLA's own thread pool and blocks there:
# as many such calls at once as the pool has threads wait for each other for ever.
_FIRST_UNSAFE = (0, 10, 0)
_FIRST_SAFE_AGAIN = (0, 11, 1)


def is_deadlock_prone(jaxlib_version: str) -> bool:
    """Say whether this jaxlib version has the deadlock of batched LAPACK calls."""
    numbers = tuple(int(part) for part in jaxlib_version.split(".")[:3] if part.isdigit())
    return _FIRST_UNSAFE <= numbers < _FIRST_SAFE_AGAIN


def require_safe_jaxlib() -> None:
    """Refuse to compute with a jaxlib that can hang.

    Raises
    ------
    UnsafeVersionError
        With the command that installs a safe version.
    """
    if is_deadlock_prone(jaxlib.__version__):
        raise UnsafeVersionError(
            f"jaxlib {jaxlib.__version__} can deadlock in batched linear algebra, so jaxink does not "
            'compute with it; install a safe one: pip install "jax>=0.9.2,!=0.10.*,!=0.11.0".'
        )


def require_float64() -> None:
    """Refuse to compute while JAX is in 32 bits.

    Raises
    ------
    PrecisionError
        With the two ways to switch 64 bits on.
    ForkedProcessError
        As `refuse_in_fork`.
    """
    require_safe_jaxlib()
    claim_process()
    # JAX makes the attributes of its configuration at run time.
    if not jax.config.jax_enable_x64:  # type: ignore[attr-defined]
        raise PrecisionError(
            "jaxink needs 64-bit floats and JAX is in 32 bits: call "
            'jax.config.update("jax_enable_x64", True) before, or work inside '
            "`with jax.enable_x64(True):`; jaxink.fit and jaxink.predict do this themselves."
        )


def release_programs(most_mappings: int | None = None) -> bool:
    """Drop JAX's compiled programs where they have taken most of the memory mappings that Linux allows.

    Every compiled program holds mappings, a fit about a thousand; a process that has used up all of them
    (65530 unless the system says otherwise) crashes in its next compilation.

    Parameters
    ----------
    most_mappings
        Number from which programs are dropped; None: half of what the system allows.

    Returns
    -------
    bool
        Whether they were dropped; functions compiled before are compiled again when they are next called.
    """
    try:
        if most_mappings is None:
            most_mappings = int(Path("/proc/sys/vm/max_map_count").read_text(encoding="ascii")) // 2
        used = Path("/proc/self/maps").read_bytes().count(b"\n")
    except OSError:
        return False
    if used < most_mappings:
        return False
    _LOG.warning("compiled programs hold %d memory mappings: they are dropped, and compiled again", used)
    jax.clear_caches()
    return True


@contextmanager
def computing() -> Iterator[None]:
    """Compute in 64 bits and with one BLAS thread; both settings are the session's again afterwards.

    The solver's matrices are small, and OpenBLAS splits those of 40 rows over threads that wait for each
    other: on a machine that does anything else besides, a solve then takes fifty times as long.

    Raises
    ------
    UnsafeVersionError
        For a jaxlib that can hang.
    ForkedProcessError
        As `refuse_in_fork`.
    """
    require_safe_jaxlib()
    claim_process()
    # Loads the BLAS that jaxlib calls, so that its threads can be limited before the first call.
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_limits

    with jax.enable_x64(True), threadpool_limits(limits=1, user_api="blas"):
        yield
