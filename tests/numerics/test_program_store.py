import os

import pytest

from jaxink.numerics import program_store
from jaxink.numerics.program_store import (
    bound_store,
    clear_store,
    kept_by_jax,
    read_program,
    store_folder,
    stored,
    write_program,
)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("JAXINK_CACHE_DIR", str(tmp_path / "store"))
    return tmp_path / "store"


def file_of(name):
    return store_folder() / "traced" / f"{name}.program"


def test_what_is_written_is_read():
    assert read_program("a") is None
    write_program("a", b"program")
    assert read_program("a") == b"program"
    assert stored().files == 1


@pytest.mark.parametrize("keep", [0, 5, 20, -1])
def test_a_truncated_file_is_no_program(keep):
    write_program("a", b"program")
    file_of("a").write_bytes(file_of("a").read_bytes()[:keep])
    assert read_program("a") is None


def test_every_changed_byte_is_noticed():
    write_program("a", b"program")
    whole = file_of("a").read_bytes()
    for i in range(len(whole)):
        file_of("a").write_bytes(whole[:i] + bytes([whole[i] ^ 1]) + whole[i + 1 :])
        assert read_program("a") is None


def test_the_oldest_files_are_dropped_first(folder):
    for age, name in enumerate("abcde"):
        write_program(name, bytes(1000))
        os.utime(file_of(name), (age, age))
    # Reading makes it the youngest.
    read_program("a")
    size = file_of("a").stat().st_size
    bound_store(5 * size)
    assert stored().files == 5
    bound_store(4 * size)
    assert sorted(p.name[0] for p in (folder / "traced").iterdir()) == ["a", "d", "e"]


def test_clearing_leaves_other_files_alone(folder):
    write_program("a", b"program")
    (folder / "compiled").mkdir()
    (folder / "compiled" / "jit_f").write_bytes(b"executable")
    (folder / "mine.txt").write_text("keep")
    assert clear_store().files == 0
    assert (folder / "mine.txt").exists()


def test_an_empty_variable_switches_it_off(monkeypatch):
    monkeypatch.setenv("JAXINK_CACHE_DIR", "")
    write_program("a", b"program")
    assert store_folder() is None
    assert read_program("a") is None
    assert stored() == (None, 0, 0)


def test_a_store_that_cannot_be_written_stays_as_it_was(folder, monkeypatch):
    write_program("a", b"program")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(program_store.os, "replace", full)
    write_program("a", b"another")
    assert read_program("a") == b"program"
    assert [p.name for p in (folder / "traced").iterdir()] == ["a.program"]


def test_jax_is_left_as_it_was(folder):
    import jax

    before = jax.config.jax_compilation_cache_dir
    try:
        jax.config.update("jax_compilation_cache_dir", None)
        seconds = jax.config.jax_persistent_cache_min_compile_time_secs
        with kept_by_jax():
            assert jax.config.jax_compilation_cache_dir == str(folder / "compiled")
            jax.jit(lambda x: x * 3 + 1)(1.0).block_until_ready()
        kept = stored().files
        assert kept > 0
        assert jax.config.jax_compilation_cache_dir is None
        assert jax.config.jax_persistent_cache_min_compile_time_secs == seconds
        # The caller's own programs do not go there.
        jax.jit(lambda x: x * 5 + 1)(1.0).block_until_ready()
        assert stored().files == kept
        jax.config.update("jax_compilation_cache_dir", str(folder / "mine"))
        with kept_by_jax():
            assert jax.config.jax_compilation_cache_dir == str(folder / "mine")
    finally:
        jax.config.update("jax_compilation_cache_dir", before)
