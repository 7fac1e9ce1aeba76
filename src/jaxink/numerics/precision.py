"""Conditions of a computation: 64-bit floats, a jaxlib that cannot deadlock, and one BLAS thread."""

import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import jax
import jaxlib

from jaxink.errors import ForkedProcessError, PlatformError, PrecisionError, UnsafeVersionError
from jaxink.numerics.compiling import LOADED
from jaxink.numerics.program_store import cached_by_jax

_LOG = logging.getLogger("jaxink")

# jaxlib 0.10.0 to 0.11.0 splits batched LAPACK calls over XLA's own thread pool and blocks there: as many
# such calls as there are threads wait for each other for ever.
_FIRST_UNSAFE = (0, 10, 0)
_FIRST_SAFE_AGAIN = (0, 11, 1)
# Values of JAX's flags under which jaxink's functions do not work, and what to compute inside instead.
_FORBIDDEN = ("disallow", "disallow_explicit"), 'transfer_guard("allow")'
_STRICT = {
    "numpy_dtype_promotion": (("strict",), 'numpy_dtype_promotion("standard")'),
    "numpy_rank_promotion": (("raise",), 'numpy_rank_promotion("allow")'),
    "transfer_guard_host_to_device": _FORBIDDEN,
    "transfer_guard_device_to_device": _FORBIDDEN,
    "transfer_guard_device_to_host": _FORBIDDEN,
}
# The process in which jaxink first computed; forked processes inherit the value.
_home: int | None = None


def is_deadlock_prone(jaxlib_version: str) -> bool:
    """Whether batched LAPACK calls can deadlock in a version of jaxlib."""
    numbers = tuple(int(part) for part in jaxlib_version.split(".")[:3] if part.isdigit())
    return _FIRST_UNSAFE <= numbers < _FIRST_SAFE_AGAIN


def require_safe_jaxlib() -> None:
    """Raise `UnsafeVersionError` if the installed version of jaxlib can hang."""
    if is_deadlock_prone(jaxlib.__version__):
        raise UnsafeVersionError(
            f"jaxlib {jaxlib.__version__} can deadlock in batched linear algebra; install a safe version: "
            'pip install "jax>=0.9.2,!=0.10.*,!=0.11.0".'
        )


def require_float64() -> None:
    """Raise `PrecisionError` if JAX uses 32-bit floats or is strict, and the errors of `computing`."""
    require_safe_jaxlib()
    claim_process()
    require_platform()
    # JAX makes the attributes of its configuration at run time.
    if not jax.config.jax_enable_x64:  # type: ignore[attr-defined]
        raise PrecisionError(
            "jaxink needs 64-bit floats, but JAX uses 32 bits; call "
            'jax.config.update("jax_enable_x64", True) first, or compute inside '
            "`with jax.enable_x64(True):`, as jaxink.fit and jaxink.predict do."
        )
    for flag, (strict, context) in _STRICT.items():
        # A derivative is computed after the function has returned, so that it cannot set them itself.
        value = getattr(jax.config, f"jax_{flag}")
        if value in strict:
            raise PrecisionError(
                f"jaxink cannot compute under JAX's flag {flag}={value}; call its functions and those made "
                f"of them, such as their gradient, inside `with jax.{context}:`, as jaxink.fit and "
                "jaxink.predict do."
            )


def require_platform() -> None:
    """Raise `PlatformError` if JAX finds none of the devices that it is told to use."""
    try:
        jax.default_backend()
    except (RuntimeError, AssertionError):
        platforms = jax.config.jax_platforms  # type: ignore[attr-defined]
        if not platforms:
            raise
        raise PlatformError(
            f"JAX finds no device of the platform {platforms!r} that JAX_PLATFORMS names; unset this "
            "variable, or set JAX_PLATFORMS=cpu, or install JAX for that device and check its driver."
        ) from None


def release_programs(most_mappings: int | None = None) -> bool:
    """Release compiled programs while they use most of the memory mappings that Linux allows.

    A process that has used all of them (65530 by default) crashes at its next compilation. This package's
    programs go first, those used least recently before others; then all that JAX keeps. Released functions
    are compiled again when they are called.

    Parameters
    ----------
    most_mappings
        Number from which programs are released; None: half of what the system allows.

    Returns
    -------
    bool
        Whether all were released.
    """
    try:
        if most_mappings is None:
            most_mappings = int(Path("/proc/sys/vm/max_map_count").read_text(encoding="ascii")) // 2
        used = _mappings()
        while used >= most_mappings and LOADED.drop_oldest():
            used = _mappings()
    except OSError:
        return False
    if used < most_mappings:
        return False
    _LOG.warning("compiled programs use %d memory mappings; they are released and compiled again", used)
    jax.clear_caches()
    return True


def _mappings() -> int:
    return Path("/proc/self/maps").read_bytes().count(b"\n")


@contextmanager
def computing() -> Iterator[None]:
    """Compute with 64-bit floats and one BLAS thread, and store programs; all settings are restored.

    Strictness that a user's own code asks of JAX does not concern jaxink's: columns meet rows, Python numbers
    meet arrays, and arrays go to the device as they come, on purpose.

    The solver's matrices are small, but OpenBLAS splits those of 40 rows over threads that wait for each
    other; on a busy machine, a solve then takes fifty times as long. Raises as `require_safe_jaxlib` and
    `claim_process` and `require_platform`.
    """
    require_safe_jaxlib()
    claim_process()
    require_platform()
    # Loads the BLAS that jaxlib calls, to limit its threads before the first call.
    import scipy.linalg  # noqa: F401
    from threadpoolctl import threadpool_limits

    with (
        jax.enable_x64(True),
        jax.numpy_dtype_promotion("standard"),
        jax.numpy_rank_promotion("allow"),
        jax.disable_jit(False),
        jax.transfer_guard("allow"),
        cached_by_jax(),
        threadpool_limits(limits=1, user_api="blas"),
    ):
        yield


def refuse_in_fork() -> None:
    """Raise `ForkedProcessError` in a fork of a process that has computed: JAX hangs without its threads."""
    if _home not in (None, os.getpid()):
        raise ForkedProcessError(
            f"this process was forked from process {_home}, which had computed with JAX, so JAX would hang; "
            'start processes by "spawn" or "forkserver", such as multiprocessing.get_context("spawn") or '
            'concurrent.futures.ProcessPoolExecutor(mp_context=multiprocessing.get_context("spawn")).'
        )


def claim_process() -> None:
    """Register this process as computing; raises as `refuse_in_fork`."""
    global _home
    refuse_in_fork()
    _home = os.getpid()
