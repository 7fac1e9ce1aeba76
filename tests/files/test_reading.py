"""What is read from a file: an ordinary one, within bounds, or a sentence that names it."""

import os
import re
import socket
import sys

import pytest

from jaxink.errors import InputRefusedError
from jaxink.files.reading import open_bounded, read_bounded, require_readable

LIMIT_BYTES = 100_000
unix = pytest.mark.skipif(sys.platform == "win32", reason="these kinds of files are of Unix")


@pytest.fixture(params=[read_bounded, require_readable], ids=["read", "checked"])
def refused(request, tmp_path):
    """What the user of a file is told, with the folder's name left out."""

    def sentence(path):
        with pytest.raises(InputRefusedError) as caught:
            request.param(path, LIMIT_BYTES, "sample file")
        return str(caught.value).replace(f"{tmp_path}{os.sep}", "")

    return sentence


def test_ordinary_files_are_read_to_the_last_byte_allowed(tmp_path):
    content = bytes(range(250)) * (LIMIT_BYTES // 250)
    (tmp_path / "full.toml").write_bytes(content)
    assert read_bounded(tmp_path / "full.toml", LIMIT_BYTES, "sample file") == content
    (tmp_path / "link.toml").symlink_to("full.toml")
    assert read_bounded(str(tmp_path / "link.toml"), LIMIT_BYTES, "sample file") == content


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("sampel.toml", "sampel.toml: there is no such sample file; did you mean sample.toml."),
        ("sample.toml/x", "sample.toml/x: cannot be read (Not a directory)."),
        ("folder", "folder: is a directory; give one sample file."),
        ("large", "large: is larger than 0.1 MB, the size that no sample file may exceed."),
        ("circle", "circle: cannot be read (Too many levels of symbolic links)."),
        (
            "pipe",
            "pipe: is a pipe, but only ordinary files are read; write the sample file to one.",
        ),
        (
            "socket",
            "socket: cannot be read (No such device or address).",
        ),
    ],
)
@unix
def test_other_files_are_refused(name, sentence, refused, tmp_path, monkeypatch):
    (tmp_path / "sample.toml").write_text("")
    (tmp_path / "folder").mkdir()
    (tmp_path / "large").write_bytes(bytes(LIMIT_BYTES + 1))
    (tmp_path / "circle").symlink_to("circle")
    os.mkfifo(tmp_path / "pipe")
    # The name of a socket may not be as long as that of the test's folder.
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX) as bound:
        bound.bind("socket")
        assert refused(tmp_path / name) == sentence


@unix
def test_devices_are_refused(refused):
    assert refused("/dev/zero").startswith("/dev/zero: is a device, but only ordinary files are read")


@pytest.mark.skipif(not os.path.exists("/proc/kallsyms"), reason="a file of Linux that claims to be empty")
def test_the_size_that_a_file_claims_is_no_bound():
    with pytest.raises(InputRefusedError, match="/proc/kallsyms: is larger than 0.001 MB"):
        read_bounded("/proc/kallsyms", 1000, "sample file")


@pytest.mark.parametrize("name", ["x" * 256, "/".join(["x" * 200] * 30)])
def test_names_that_are_too_long_are_refused_and_shortened(name, refused, tmp_path):
    said = refused(tmp_path / name)
    assert len(said) < 400
    assert re.search(r"x\.\.\.x+: the name is longer than any file's can be; name one sample file\.$", said)


def test_names_that_no_file_has_are_refused_on_one_line(refused):
    assert refused("a\0b") == r"'a\x00b': holds a zero byte, which no file's name can; name one sample file."
    assert refused("a\nb") == r"'a\nb': there is no such sample file."


def test_files_without_permission_are_refused(refused, tmp_path, monkeypatch):
    def forbidden(*_):
        raise PermissionError(13, "Permission denied")

    # Root may read everything, so that permissions alone would not do.
    monkeypatch.setattr(os, "open", forbidden)
    assert refused(tmp_path / "secret") == "secret: cannot be read (Permission denied)."


def test_faults_of_what_is_done_with_an_open_file_are_not_hidden(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(KeyError), open_bounded(tmp_path / "file", LIMIT_BYTES, "sample file"):
        raise KeyError("x")
