"""Whatever lies at the path of an output is followed, kept or written to, never replaced by something else."""

import os
import stat
import subprocess
import sys
import threading
from contextlib import suppress

import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.storage.growing_file import append_bytes
from atg_fg.storage.plain_files import check_writable, write_bytes_atomically

WRITE = (
    "import sys; from atg_fg.storage.plain_files import *; "
    "check_writable(sys.argv[1]); write_bytes_atomically(sys.argv[1], b'new')"
)


def mode_of(path):
    return stat.S_IMODE(path.stat().st_mode)


@pytest.fixture
def umask():
    before = os.umask(0o027)
    yield
    os.umask(before)


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o644, 0o664, 0o755])
def test_a_file_that_is_there_keeps_its_mode(tmp_path, mode):
    path = tmp_path / "there"
    path.write_bytes(b"old")
    path.chmod(mode)
    check_writable(path)
    write_bytes_atomically(path, b"new")
    assert (path.read_bytes(), mode_of(path)) == (b"new", mode)


def test_a_new_file_gets_the_mode_that_the_umask_leaves(tmp_path, umask):
    write_bytes_atomically(tmp_path / "new", b"new")
    assert mode_of(tmp_path / "new") == 0o640


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root can give files away")
def test_a_file_keeps_its_owner(tmp_path):
    (tmp_path / "there").write_bytes(b"old")
    os.chown(tmp_path / "there", 1234, 2345)
    write_bytes_atomically(tmp_path / "there", b"new")
    status = (tmp_path / "there").stat()
    assert (status.st_uid, status.st_gid) == (1234, 2345)


@pytest.mark.parametrize("there", [True, False])
def test_links_are_followed_to_the_file_they_lead_to_be_it_there_or_not(tmp_path, there):
    (tmp_path / "far").mkdir()
    target = tmp_path / "far" / "target"
    if there:
        target.write_bytes(b"old")
    (tmp_path / "link").symlink_to("far/target")
    (tmp_path / "link to link").symlink_to(tmp_path / "link")
    check_writable(tmp_path / "link to link")
    write_bytes_atomically(tmp_path / "link to link", b"new")
    assert target.read_bytes() == b"new"
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "link to link").is_symlink()
    assert sorted(os.listdir(tmp_path / "far")) == ["target"]


def test_links_in_a_loop_are_refused(tmp_path):
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    for write in (check_writable, lambda path: write_bytes_atomically(path, b"new")):
        with pytest.raises(InvalidInputError, match="cannot be written"):
            write(tmp_path / "a")
    assert (tmp_path / "a").is_symlink()


def test_a_link_to_a_folder_is_refused(tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "link").symlink_to("folder")
    for write in (check_writable, lambda path: write_bytes_atomically(path, b"new")):
        with pytest.raises(InvalidInputError, match="is a folder"):
            write(tmp_path / "link")


def test_a_pipe_stays_a_pipe_and_gets_what_is_written(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    check_writable(pipe)  # opens nothing: it would wait for a reader
    read = []
    reader = threading.Thread(target=lambda: read.append(pipe.read_bytes()))
    reader.start()
    write_bytes_atomically(pipe, b"new")
    reader.join(10)
    assert read == [b"new"]
    assert stat.S_ISFIFO(pipe.stat().st_mode)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root could replace a device")
def test_a_device_stays_a_device(tmp_path):
    device = tmp_path / "null"
    try:
        os.mknod(device, 0o666 | stat.S_IFCHR, os.makedev(1, 3))
    except OSError:
        pytest.skip("no devices can be made here")
    for path in (device, "/dev/null"):
        check_writable(path)
        with suppress(InvalidInputError):  # on a file system without devices
            write_bytes_atomically(path, b"new")
        assert stat.S_ISCHR(os.stat(path).st_mode)


@pytest.mark.parametrize("path", ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"])
def test_standard_output_by_any_name_is_written_to(path, tmp_path):
    piped = subprocess.run([sys.executable, "-c", WRITE, path], stdout=subprocess.PIPE, check=True)
    assert piped.stdout == b"new"
    (tmp_path / "link").symlink_to(path)
    with open(tmp_path / "out", "wb") as file:
        script = f"print('before'); {WRITE}; print('after')"
        subprocess.run([sys.executable, "-c", script, str(tmp_path / "link")], stdout=file, check=True)
    assert (tmp_path / "out").read_bytes() == b"before\nnewafter\n"  # neither overwrites the other


def test_what_a_shell_makes_of_a_process_is_written_to(tmp_path):
    script = f'"$0" -c "$1" >(cat > {tmp_path}/got; echo > {tmp_path}/done) && until [ -e {tmp_path}/done ]; do :; done'
    subprocess.run(["bash", "-c", script, sys.executable, WRITE], check=True, timeout=60)
    assert (tmp_path / "got").read_bytes() == b"new"


def test_a_descriptor_that_is_not_open_is_refused():
    for write in (check_writable, lambda path: write_bytes_atomically(path, b"new")):
        with pytest.raises(InvalidInputError, match="cannot be written"):
            write("/dev/fd/987654")


def test_what_a_killed_writer_leaves_is_removed_by_the_next_one_and_nothing_else(tmp_path):
    script = (
        "import os, signal, sys; from atg_fg.storage.plain_files import write_bytes_atomically; "
        "os.fsync = lambda _: os.kill(os.getpid(), signal.SIGKILL); write_bytes_atomically(sys.argv[1], b'new')"
    )
    path = tmp_path / "file"
    write_bytes_atomically(path, b"old")
    (tmp_path / ".atg-fg-notes").write_bytes(b"mine")
    subprocess.run([sys.executable, "-c", script, str(path)], check=False)
    left = set(os.listdir(tmp_path)) - {"file", ".atg-fg-notes"}
    assert len(left) == 1
    assert path.read_bytes() == b"old"
    write_bytes_atomically(tmp_path / "other", b"new")
    assert sorted(os.listdir(tmp_path)) == [".atg-fg-notes", "file", "other"]


def test_many_writers_at_once_do_not_take_each_other_for_killed(tmp_path):
    def write(number):
        for _ in range(20):
            write_bytes_atomically(tmp_path / f"file-{number % 2}", b"x" * 1000)

    errors = []

    def caught(number):
        try:
            write(number)
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=caught, args=(number,)) for number in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert errors == []
    assert sorted(os.listdir(tmp_path)) == ["file-0", "file-1"]


def test_a_name_as_long_as_can_be_is_written(tmp_path):
    write_bytes_atomically(tmp_path / ("x" * 255), b"new")
    assert (tmp_path / ("x" * 255)).read_bytes() == b"new"


def test_bytes_that_cannot_be_added_leave_the_file_as_long_as_it_was(tmp_path, monkeypatch):
    path = tmp_path / "log"
    path.write_bytes(b"old")
    assert append_bytes(path, b"new") == 6
    write = os.write

    def a_disk_with_room_for_two_bytes(descriptor, content):
        if len(content) <= 2:
            raise OSError(28, "No space left on device")
        return write(descriptor, content[:2])

    with monkeypatch.context() as patched:
        patched.setattr(os, "write", a_disk_with_room_for_two_bytes)
        with pytest.raises(InvalidInputError, match="No space left on device; what it held is kept"):
            append_bytes(path, b"four")
    assert path.read_bytes() == b"oldnew"
