import os
import subprocess
import threading

import jax
import pytest
from jax.experimental.compilation_cache import compilation_cache

from jaxink.numerics import named_files, program_store
from jaxink.numerics.program_store import (
    COMPILED,
    bound_store,
    cached_by_jax,
    clear_store,
    read_program,
    store_folder,
    stored,
    why_not_stored,
    write_program,
)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("JAXINK_CACHE_DIR", str(tmp_path / "store"))
    return tmp_path / "store"


def file_of(name):
    return store_folder() / "traced" / f"{name}.program"


def exchange(one, two):
    other = two.read_bytes()
    two.write_bytes(one.read_bytes())
    one.write_bytes(other)


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
    (folder / "compiled").mkdir(0o700)
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

    monkeypatch.setattr(named_files.os, "replace", full)
    write_program("a", b"another")
    assert read_program("a") == b"program"
    assert [p.name for p in (folder / "traced").iterdir()] == ["a.program"]


def test_an_exchanged_file_is_no_program(folder):
    write_program("a", b"one")
    write_program("b", b"two")
    exchange(file_of("a"), file_of("b"))
    assert read_program("a") is None
    assert read_program("b") is None
    write_program("a", b"one")
    (folder / "compiled").mkdir(0o700)
    file_of("a").replace(folder / "compiled" / "a.program")
    assert read_program("a", COMPILED) is None


def test_nobody_else_may_write_to_a_new_store(folder):
    before = os.umask(0)
    try:
        for kind in ("traced", COMPILED):
            write_program("a", b"program", kind)
    finally:
        os.umask(before)
    for path in (folder, *folder.rglob("*")):
        assert path.stat().st_mode & 0o077 == 0


@pytest.fixture
def logged(caplog):
    program_store._warn_once.cache_clear()
    caplog.set_level("WARNING", "jaxink")
    return caplog


@pytest.mark.skipif(os.name != "posix", reason="rights as POSIX has them")
@pytest.mark.parametrize("part", ["", "traced", "compiled"])
@pytest.mark.parametrize("mode", [0o777, 0o1777, 0o720, 0o702])
def test_a_store_that_others_can_write_to_is_not_used(folder, part, mode, logged):
    for kind in ("traced", COMPILED):
        write_program("a", b"program", kind)
    (folder / part).chmod(mode)
    for kind in ("traced", COMPILED):
        assert read_program("a", kind) is None
        write_program("b", b"program", kind)
    assert stored() == (None, 0, 0)
    with cached_by_jax():
        jax.jit(lambda x: x * 13 + 1)(1.0).block_until_ready()
    assert sum(path.is_file() for path in folder.rglob("*")) == 2
    assert logged.messages == [why_not_stored()]
    # What the sentence proposes is enough.
    subprocess.run(["chmod", "-R", "go-w", folder], check=True)
    assert read_program("a") == b"program"
    assert why_not_stored() is None


@pytest.mark.skipif(os.name != "posix", reason="owners as POSIX has them")
def test_a_store_of_another_user_is_not_used(folder, monkeypatch, logged, told):
    write_program("a", b"program")
    another = os.geteuid() + 1
    monkeypatch.setattr(os, "geteuid", lambda: another)
    assert read_program("a") is None
    assert store_folder() is None
    assert logged.messages == [why_not_stored()]
    told(logged.messages[0], "another user", "JAXINK_CACHE_DIR")


def test_where_nobody_knows_owners_the_store_is_used(folder, monkeypatch):
    write_program("a", b"program")
    folder.chmod(0o777)
    monkeypatch.delattr(os, "geteuid", raising=False)
    assert read_program("a") == b"program"


def pipe(path):
    os.mkfifo(path)


def endless(path):
    path.symlink_to("/dev/zero")


def huge(path):
    with open(path, "wb") as file:
        file.truncate(3_000_000_000)


def not_own(path):
    program_store.write_program(path.stem, b"program", path.parent.name)
    path.chmod(0o666)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="files as POSIX has them")
@pytest.mark.parametrize("kind", ["traced", "compiled"])
@pytest.mark.parametrize("make", [pipe, endless, huge, not_own])
def test_only_ordinary_files_of_the_user_are_read(folder, kind, make):
    path = folder / kind / "a.program"
    path.parent.mkdir(0o700, parents=True)
    folder.chmod(0o700)
    make(path)
    read = []
    # Reading a pipe would never end.
    reader = threading.Thread(target=lambda: read.append(read_program("a", kind)), daemon=True)
    reader.start()
    reader.join(20)
    assert read == [None]


@pytest.fixture
def without_own_cache():
    """JAX without a cache that the process has chosen."""
    before = jax.config.jax_compilation_cache_dir
    jax.config.update("jax_compilation_cache_dir", None)
    yield
    jax.config.update("jax_compilation_cache_dir", before)


def tripled(x):
    return x * 3 + 1


def squared(x):
    return x * x + 1


@pytest.mark.parametrize("damage", ["exchanged", "cut", "other"])
def test_what_jax_has_compiled_is_tied_to_its_name(folder, without_own_cache, damage):
    jax.clear_caches()
    with cached_by_jax():
        assert [jax.jit(f)(4.0) for f in (tripled, squared)] == [13, 17]
        (one,) = (folder / "compiled").glob("*tripled*")
        (two,) = (folder / "compiled").glob("*squared*")
        whole = one.read_bytes()
        if damage == "exchanged":
            exchange(one, two)
        else:
            one.write_bytes(whole[:-9] if damage == "cut" else b"something else")
        jax.clear_caches()
        assert [jax.jit(f)(4.0) for f in (tripled, squared)] == [13, 17]
    # What was damaged has been replaced.
    assert read_program(one.stem, COMPILED) is not None


def test_a_jax_that_takes_no_cache_compiles_all_the_same(folder, without_own_cache, monkeypatch):
    from jax._src import compilation_cache

    monkeypatch.delattr(compilation_cache, "_cache")
    monkeypatch.setattr(compilation_cache, "is_cache_used", lambda backend: False)
    with cached_by_jax():
        assert jax.jit(lambda x: x * 7 + 1)(1.0) == 8
    assert stored().files == 0


def test_jax_is_left_as_it_was(folder, without_own_cache):
    seconds = jax.config.jax_persistent_cache_min_compile_time_secs
    with cached_by_jax():
        # JAX would read a folder of its own without checking.
        assert jax.config.jax_compilation_cache_dir is None
        jax.jit(lambda x: x * 3 + 1)(1.0).block_until_ready()
    kept = stored().files
    assert kept > 0
    assert jax.config.jax_compilation_cache_dir is None
    assert jax.config.jax_persistent_cache_min_compile_time_secs == seconds
    # The caller's own programs do not go there.
    jax.jit(lambda x: x * 5 + 1)(1.0).block_until_ready()
    assert stored().files == kept


def test_a_cache_of_the_users_own_is_the_one_used(folder, without_own_cache):
    mine = folder.parent / "mine"
    jax.config.update("jax_compilation_cache_dir", str(mine))
    seconds = jax.config.jax_persistent_cache_min_compile_time_secs
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    compilation_cache.reset_cache()
    try:
        with cached_by_jax():
            jax.jit(lambda x: x * 9 + 1)(1.0).block_until_ready()
        assert jax.config.jax_compilation_cache_dir == str(mine)
        assert stored().files == 0
        kept = len(list(mine.iterdir()))
        assert kept > 0
        jax.jit(lambda x: x * 11 + 1)(1.0).block_until_ready()
        assert len(list(mine.iterdir())) > kept
    finally:
        jax.config.update("jax_persistent_cache_min_compile_time_secs", seconds)
        jax.config.update("jax_compilation_cache_dir", None)
        compilation_cache.reset_cache()
