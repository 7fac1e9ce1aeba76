"""What is read from a file: an ordinary one, within bounds, or a sentence that names it."""

import os
import socket
import sys

import pytest

from jaxink.errors import InputRefusedError
from jaxink.files.reading import open_bounded, read_bounded

LIMIT_BYTES = 100_000
unix = pytest.mark.skipif(sys.platform == "win32", reason="these kinds of files are of Unix")


@pytest.fixture
def refused_file(refused):
    """Refuses a file by a sentence that names all of these; gives the sentence."""

    def refuse(path, *named):
        with refused(*named) as caught:
            read_bounded(path, LIMIT_BYTES, "sample file")
        return str(caught.value)

    return refuse


def test_ordinary_files_are_read_to_the_last_byte_allowed(tmp_path):
    content = bytes(range(250)) * (LIMIT_BYTES // 250)
    (tmp_path / "full.toml").write_bytes(content)
    assert read_bounded(tmp_path / "full.toml", LIMIT_BYTES, "sample file") == content
    (tmp_path / "link.toml").symlink_to("full.toml")
    assert read_bounded(str(tmp_path / "link.toml"), LIMIT_BYTES, "sample file") == content


@pytest.mark.parametrize(
    "name", ["sampel.toml", "sample.toml/x", "folder", "large", "circle", "pipe", "socket"]
)
@unix
def test_other_files_are_refused(name, refused_file, tmp_path, monkeypatch):
    (tmp_path / "sample.toml").write_text("")
    (tmp_path / "folder").mkdir()
    (tmp_path / "large").write_bytes(bytes(LIMIT_BYTES + 1))
    (tmp_path / "circle").symlink_to("circle")
    os.mkfifo(tmp_path / "pipe")
    # The name of a socket may not be as long as that of the test's folder.
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX) as bound:
        bound.bind("socket")
        refused_file(tmp_path / name, f"{tmp_path / name}: ")


@unix
def test_devices_are_refused(refused_file):
    refused_file("/dev/zero", "/dev/zero: ")


@pytest.mark.skipif(not os.path.exists("/proc/kallsyms"), reason="a file of Linux that claims to be empty")
def test_the_size_that_a_file_claims_is_no_bound(refused):
    with refused("/proc/kallsyms: ", "0.001 MB"):
        read_bounded("/proc/kallsyms", 1000, "sample file")


@pytest.mark.parametrize("name", ["x" * 256, "/".join(["x" * 200] * 30)], ids=["name", "path"])
def test_names_that_are_too_long_are_refused_and_shortened(name, tmp_path):
    # Where it is cut depends on the folder.
    with pytest.raises(InputRefusedError, match=r"x\.\.\.x+: .*sample file") as caught:
        read_bounded(tmp_path / name, LIMIT_BYTES, "sample file")
    assert len(str(caught.value)) < 400


def test_names_that_no_file_has_are_refused_on_one_line(refused_file):
    refused_file("a\0b", r"'a\x00b': ")
    refused_file("a\nb", r"'a\nb': ")


def test_files_without_permission_are_refused(refused_file, tmp_path, monkeypatch):
    def forbidden(*_):
        raise PermissionError(13, "Permission denied")

    # Root may read everything, so that permissions alone would not do.
    monkeypatch.setattr(os, "open", forbidden)
    refused_file(tmp_path / "secret", f"{tmp_path / 'secret'}: ", "Permission denied")


def test_faults_of_what_is_done_with_an_open_file_are_not_hidden(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(KeyError), open_bounded(tmp_path / "file", LIMIT_BYTES, "sample file"):
        raise KeyError("x")
