"""What a fit changes in the session, and that it is undone."""

from pathlib import Path

import jax
import jax.numpy as jnp
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from jaxink.numerics.precision import computing, release_programs


def blas_threads():
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


def test_computing_is_in_64_bits_with_one_blas_thread_and_leaves_the_session_as_it_was():
    with jax.enable_x64(False), computing():
        pass
    # The tests run with one thread; a user's session has more.
    with jax.enable_x64(False), threadpool_limits(limits=2, user_api="blas"):
        before = blas_threads()
        assert before == {2}
        with computing():
            assert jax.config.jax_enable_x64
            assert blas_threads() == {1}
        assert not jax.config.jax_enable_x64
        assert blas_threads() == before


def test_the_session_comes_back_after_an_error():
    with threadpool_limits(limits=2, user_api="blas"):
        with pytest.raises(KeyError), computing():
            raise KeyError
        assert blas_threads() == {2}


@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="this system tells nothing of its mappings")
def test_compiled_programs_are_dropped_before_the_mappings_run_out(caplog, told):
    double = jax.jit(lambda x: 2 * x)
    assert double(jnp.array(3.0)) == 6
    assert not release_programs()
    assert double._cache_size() == 1
    assert release_programs(most_mappings=10)
    assert double._cache_size() == 0
    (record,) = caplog.records
    told(record.getMessage(), numbers=False)
    assert double(jnp.array(3.0)) == 6
