"""A folder of output takes its place whole or not at all, whatever fails and whenever it is killed."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from jaxink.errors import InputRefusedError
from jaxink.files.exchange import settle
from jaxink.files.staging import left_over, staged_in
from jaxink.files.writing import whole_folder, written_whole

OWNED = ("figures", "simplex")
OLD = {
    "result.json": "old",
    "result.nc": "old",
    "figures/a.png": "old",
    "figures/b.png": "old",
    "simplex/result.json": "old",
    "notes.txt": "mine",
}
NEW = {"result.json": "new", "result.nc": "new", "figures/a.png": "new", "notes.txt": "mine"}
WRITTEN = {name: text for name, text in NEW.items() if text == "new"}
MINE = {"mine/data.csv": "mine"}


def put(folder, files):
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def tree(folder):
    return {str(p.relative_to(folder)): p.read_text() for p in sorted(folder.rglob("*")) if p.is_file()}


def killed_runs_stage(folder):
    """What a run that was killed while it wrote leaves: nobody holds its lock."""
    with staged_in(folder) as stage:
        return Path(shutil.copytree(stage, folder / ".jaxink-abcdefgh"))


def replace(out):
    with whole_folder(out, OWNED) as folder:
        put(folder, WRITTEN)


@pytest.fixture(params=["alone", "own folder", "worked in"])
def out(request, tmp_path, monkeypatch):
    """An old result beside the user's own files."""
    out = tmp_path / "place" / "out"
    put(out, OLD)
    if request.param == "own folder":
        put(out, MINE)
    elif request.param == "worked in":
        monkeypatch.chdir(out)
    return out


def count_renames(monkeypatch, fail_at, for_good=False):
    """Renames done; one of them fails, or all from then on."""
    done = []

    def counted(plain):
        def renamed(source, target):
            done.append((source, target))
            if len(done) == fail_at or (for_good and len(done) > fail_at):
                raise OSError(5, "Input/output error")
            plain(source, target)

        return renamed

    for name in ("rename", "replace"):
        monkeypatch.setattr(os, name, counted(getattr(os, name)))
    return done


def test_new_entries_replace_the_old_and_the_users_own_stay(out):
    mine = tree(out).keys() & MINE.keys()
    inode = (out / "notes.txt").stat().st_ino
    os.chmod(out, 0o750)
    replace(out)
    assert tree(out) == NEW | {name: MINE[name] for name in mine}
    assert (out / "notes.txt").stat().st_ino == inode
    assert out.stat().st_mode & 0o777 == 0o750
    assert [p.name for p in out.parent.iterdir()] == ["out"]


@pytest.mark.parametrize("fail_at", range(1, 12))
def test_after_a_fault_at_any_rename_the_folder_is_as_it_was(fail_at, out, monkeypatch, told):
    before = tree(out)
    with monkeypatch.context() as patch:
        done = count_renames(patch, fail_at)
        sentence = None
        try:
            replace(out)
        except InputRefusedError as problem:
            sentence = str(problem)
    if len(done) < fail_at:
        assert sentence is None
        assert tree(out) == NEW | {name: text for name, text in before.items() if name in MINE}
    else:
        told(sentence, f"{out}: ", "Input/output error")
        assert tree(out) == before
    assert [p.name for p in out.parent.iterdir()] == ["out"]


def test_what_cannot_be_taken_back_is_finished_by_the_next_run(tmp_path, monkeypatch):
    put(tmp_path / "out", OLD | MINE)
    with monkeypatch.context() as patch:
        count_renames(patch, 4, for_good=True)
        with pytest.raises(InputRefusedError):
            replace(tmp_path / "out")
    settle(tmp_path / "out")
    assert tree(tmp_path / "out") == NEW | MINE


def test_an_interruption_between_two_renames_is_taken_back(tmp_path, monkeypatch):
    put(tmp_path / "out", OLD | MINE)
    plain, done = os.rename, []

    def renamed(source, target):
        done.append(source)
        if len(done) == 4:
            raise KeyboardInterrupt
        plain(source, target)

    monkeypatch.setattr(os, "rename", renamed)
    with pytest.raises(KeyboardInterrupt):
        replace(tmp_path / "out")
    assert tree(tmp_path / "out") == OLD | MINE


KILLED = """
import os, signal, sys
from jaxink.files.writing import whole_folder

out, kill_at, when = sys.argv[1], int(sys.argv[2]), sys.argv[3]
steps = 0

def step(plain):
    def stepped(*arguments):
        global steps
        steps += 1
        if steps == kill_at and when == "before":
            os.kill(os.getpid(), signal.SIGKILL)
        result = plain(*arguments)
        if steps == kill_at and when == "after":
            os.kill(os.getpid(), signal.SIGKILL)
        return result
    return stepped

os.rename, os.replace = step(os.rename), step(os.replace)
with whole_folder(out, ("figures", "simplex")) as folder:
    (folder / "figures").mkdir()
    for name in ("result.json", "result.nc", "figures/a.png"):
        (folder / name).write_text("new")
"""


def killed(out, at, when):
    """Whether a process that replaces the folder was killed at a step."""
    arguments = [sys.executable, "-c", KILLED, str(out), str(at), when]
    done = subprocess.run(arguments, timeout=60, check=False, capture_output=True, text=True)
    assert done.returncode in (0, -signal.SIGKILL), done.stderr
    return done.returncode != 0


@pytest.mark.parametrize("at", range(1, 9))
def test_what_a_kill_leaves_half_done_is_settled(at, tmp_path):
    out = tmp_path / "out"
    put(out, OLD | MINE)
    assert killed(out, at, "before")
    settle(out)
    assert tree(out) == (OLD | MINE if at == 1 else NEW | MINE)
    assert {p.name for p in tmp_path.iterdir()} == {"out"}


def test_left_overs_of_other_runs_are_neither_in_the_way_nor_taken_from_the_living(tmp_path):
    named_by_process = tmp_path / f".out.jaxink-{os.getpid()}"
    put(named_by_process, {"theirs": "x"})
    with staged_in(tmp_path) as living:
        put(living, {"theirs": "x"})
        replace(tmp_path / "out")
        assert tree(living)["theirs"] == "x"
    assert tree(tmp_path / "out") == WRITTEN
    assert tree(named_by_process) == {"theirs": "x"}
    long_ago = time.time() - 2 * 24 * 3600
    os.utime(named_by_process, (long_ago, long_ago))
    replace(tmp_path / "out")
    assert [p.name for p in tmp_path.iterdir()] == ["out"]


def test_folders_that_only_look_like_left_overs_stay(tmp_path, monkeypatch):
    put(tmp_path / ".jaxink-settings", {"a": "mine"})
    stage = killed_runs_stage(tmp_path)
    (tmp_path / ".jaxink-linked01").symlink_to(stage)
    with monkeypatch.context() as patch:
        patch.setattr(os, "geteuid", lambda: os.getuid() + 1, raising=False)
        assert list(left_over(tmp_path)) == []
    assert [*left_over(tmp_path)] == [stage]
    replace(tmp_path / "out")
    assert {p.name for p in tmp_path.iterdir()} == {".jaxink-settings", ".jaxink-linked01", "out"}


@pytest.mark.parametrize("fails", [True, False])
def test_a_new_folder_in_new_folders(fails, tmp_path, monkeypatch):
    if fails:
        count_renames(monkeypatch, 1)
        with pytest.raises(InputRefusedError):
            replace(tmp_path / "a" / "b" / "out")
        assert list(tmp_path.iterdir()) == []
        return
    replace(tmp_path / "a" / "b" / "out")
    assert tree(tmp_path) == {f"a/b/out/{name}": text for name, text in WRITTEN.items()}
    assert (tmp_path / "a" / "b" / "out").stat().st_mode == (tmp_path / "a").stat().st_mode


def test_a_folder_that_another_run_made_meanwhile_is_replaced(tmp_path):
    with whole_folder(tmp_path / "out", OWNED) as folder:
        put(folder, WRITTEN)
        put(tmp_path / "out", OLD)
    assert tree(tmp_path / "out") == NEW


def test_what_comes_into_the_folder_meanwhile_is_not_lost(tmp_path):
    put(tmp_path / "out", OLD)
    with whole_folder(tmp_path / "out", OWNED) as folder:
        put(folder, WRITTEN)
        put(tmp_path / "out", {"late.txt": "mine", "notes.txt": "mine, again"})
    assert tree(tmp_path / "out") == NEW | {"late.txt": "mine", "notes.txt": "mine, again"}


def test_a_symbolic_link_to_a_folder_stays_one(tmp_path):
    put(tmp_path / "real" / "out", OLD)
    (tmp_path / "link").symlink_to(Path("real", "out"))
    replace(tmp_path / "link")
    assert (tmp_path / "link").is_symlink()
    assert tree(tmp_path / "real" / "out") == NEW
    assert sorted(p.name for p in tmp_path.iterdir()) == ["link", "real"]


def test_what_cannot_be_a_folder_is_refused(tmp_path, refused):
    (tmp_path / "file").write_text("")
    (tmp_path / "nowhere").symlink_to("absent")
    for name in ("file", "file/out", "nowhere", "x" * 300, "a\0b"):
        with refused("/" + name[0]):
            replace(tmp_path / name)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "nowhere"]


def test_a_file_is_written_whole_and_a_killed_runs_part_is_removed(tmp_path):
    put(killed_runs_stage(tmp_path), {"other.csv": "half"})
    (tmp_path / "file.csv").write_text("old")

    def fail():
        with written_whole(tmp_path / "file.csv") as part:
            part.write_text("half")
            raise OSError("full")

    with pytest.raises(InputRefusedError, match="file.csv: cannot be written there .full.;"):
        fail()
    assert tree(tmp_path) == {"file.csv": "old"}
    with written_whole(tmp_path / "file.csv") as part:
        part.write_text("new")
    assert tree(tmp_path) == {"file.csv": "new"}
