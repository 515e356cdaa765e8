"""Whatever lies at the path of a file of any kind: one error that names it and says what was expected, at once."""

import os
import socket
import time

import pytest

from atg_fg.core.errors import AtgError
from atg_fg.storage import named_pipes
from tests.torture.originals import originals
from tests.torture.reading import READERS, SUFFIXES

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")


def folder(path):
    path.mkdir()


def links_in_a_circle(path):
    path.symlink_to(path.with_name("back"))
    path.with_name("back").symlink_to(path)


def socket_of_a_server(path):
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(path))


def file_that_shrank(path):
    path.symlink_to("/proc/self/mem")  # opens, and cannot be read


LYING = {
    "nothing": lambda path: None,
    "folder": folder,
    "links in a circle": links_in_a_circle,
    "empty file": lambda path: path.write_bytes(b""),
    "pipe without a writer": os.mkfifo,
    "socket": socket_of_a_server,
    "what cannot be read": file_that_shrank,
    "device without an end": lambda path: path.symlink_to("/dev/zero"),
    "empty device": lambda path: path.symlink_to("/dev/null"),
}
#: What reads a folder of files, or begins the file that is not there.
KINDS = [kind for kind in READERS if kind not in ("SQLite bag", "bag metadata")]


@pytest.fixture
def refusal(tmp_path, monkeypatch):
    """Read a path as a file of a kind; return the error, and check that it comes at once."""
    monkeypatch.setattr(named_pipes, "PIPE_WAIT", 0.1)
    monkeypatch.chdir(tmp_path)  # the names of sockets are short

    def of(kind, path):
        begun = time.process_time()
        with pytest.raises(AtgError) as error:
            READERS[kind](path)
        assert time.process_time() - begun < 5
        assert "expected" in str(error.value)
        return str(error.value)

    return of


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_no_file_is_refused_by_name(kind, tmp_path, refusal):
    originals()
    for number, (what, lay) in enumerate(LYING.items()):
        if (kind, what) in (("ablation log", "nothing"), ("ablation log", "empty file")):
            continue  # it is begun
        path = tmp_path / f"x{number}{SUFFIXES.get(kind, '')}"
        lay(path)
        assert str(path) in refusal(kind, path), what


@pytest.mark.parametrize("kind", KINDS)
def test_a_path_that_no_file_can_have_is_refused(kind, tmp_path, refusal):
    refusal(kind, tmp_path / f"{'x' * 300}{SUFFIXES.get(kind, '')}")
    refusal(kind, tmp_path / f"a\0b{SUFFIXES.get(kind, '')}")
    (tmp_path / "file").write_bytes(originals()[kind][0])
    refusal(kind, tmp_path / "file" / f"inside{SUFFIXES.get(kind, '')}")
