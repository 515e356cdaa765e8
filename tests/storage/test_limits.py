"""Small files that unfold to gigabytes are refused in bounded time and memory; what is allowed can be raised."""

import gzip
import io
import os
import resource
import subprocess
import sys
import zipfile
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.core.compact.compact_memory import GraphArrays
from atg_fg.core.errors import InvalidInputError, TooLargeError
from atg_fg.storage.limits import LIMIT_VARIABLE, MAX_UNPACKED_BYTES, gzip_members
from atg_fg.storage.plain_files import read_bytes_file, read_gzipped_text, read_text_file

ARRAYS = ("header", *GraphArrays._fields)


def packed(head, n_mebibytes):
    """Return a gzip member that unfolds to many spaces; its checksum is not theirs."""
    packer = zlib.compressobj(9, zlib.DEFLATED, 31)
    begin = packer.compress(head) + packer.flush(zlib.Z_FULL_FLUSH)
    block = packer.compress(b" " * 2**20) + packer.flush(zlib.Z_FULL_FLUSH)
    return begin + block * n_mebibytes + packer.flush()


def archive(n_bytes, compression=zipfile.ZIP_DEFLATED, declared=None):
    """Return a file of arrays whose header array has so many bytes, or says that it has as many as are declared."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", compression, compresslevel=1) as made:
        for name in ARRAYS:
            size = n_bytes if name == "header" else 0
            with made.open(f"{name}.npy", "w", force_zip64=True) as member:
                shape = (size if declared is None else declared,)
                np.lib.format.write_array_header_1_0(member, {"descr": "|u1", "fortran_order": False, "shape": shape})
                for _ in range(size >> 20):
                    member.write(bytes(2**20))
    return file.getvalue()


BOMBS = {
    "run.json.gz": lambda: packed(b'{"format":"atg-fg/goal-run",', 1500),
    "test.jsonl.gz": lambda: packed(b'{"format":"atg-fg/test","version":1', 1500),
    "many members.jsonl.gz": lambda: packed(b"", 1) * 1500,
    "packed.npz": lambda: archive(200 << 20),
    "packed by bzip2.npz": lambda: archive(100 << 20, zipfile.ZIP_BZIP2),
    "declared.npz": lambda: archive(0, declared=10**12),
}


@pytest.mark.parametrize("name", BOMBS)
def test_a_small_file_that_unfolds_to_gigabytes_is_refused_in_little_time_and_memory(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(BOMBS[name]())
    assert path.stat().st_size < 4 * 2**20
    read = "from atg_fg.report.reading import read_report as read"
    if path.suffix == ".npz":
        read = "from atg_fg.storage.memory_files import load_memory as read"
    script = f"""if True:
        import resource, sys, time
        from pathlib import Path
        from atg_fg.core.errors import AtgError
        {read}
        before, start = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, time.process_time()
        try:
            read(Path(sys.argv[1]))
        except AtgError as error:
            print(time.process_time() - start, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before, error)
    """
    done = subprocess.run([sys.executable, "-c", script, str(path)], capture_output=True, text=True, check=True)
    seconds, kibibytes, message = done.stdout.split(" ", 2)
    assert float(seconds) < 2
    assert int(kibibytes) < 200 * 2**10
    assert message.startswith(f"{path}: ")


def test_the_limit_is_said_and_an_environment_variable_raises_it(tmp_path, monkeypatch):
    path = tmp_path / "run.json.gz"
    path.write_bytes(gzip.compress(b"{}" + bytes(100 * 2**20), 1))
    with pytest.raises(TooLargeError, match=f"more than {MAX_UNPACKED_BYTES:,} bytes.*{LIMIT_VARIABLE}"):
        read_gzipped_text(path, "expected a run")
    monkeypatch.setenv(LIMIT_VARIABLE, str(2**27))
    assert len(read_gzipped_text(path, "expected a run")) == 2 + 100 * 2**20
    monkeypatch.setenv(LIMIT_VARIABLE, "1000")
    with pytest.raises(TooLargeError, match="more than"):
        read_bytes_file(path)


@pytest.mark.parametrize("given", ["0", "-1", "1e9", "many", "1" * 30])
def test_a_limit_that_is_no_number_is_refused(tmp_path, monkeypatch, given):
    (tmp_path / "file").write_bytes(b"")
    monkeypatch.setenv(LIMIT_VARIABLE, given)
    with pytest.raises(InvalidInputError, match=f"{LIMIT_VARIABLE}: .*expected a whole number"):
        read_bytes_file(tmp_path / "file")


def test_a_file_with_a_hole_of_terabytes_is_refused_by_its_size(tmp_path):
    with open(tmp_path / "sparse", "wb") as file:
        try:
            file.truncate(2**42)
        except OSError:
            pytest.skip("the file system takes no such file")
    with pytest.raises(TooLargeError, match="more than"):
        read_text_file(tmp_path / "sparse")


@pytest.mark.skipif(not os.path.exists("/dev/zero"), reason="no /dev/zero")
def test_a_stream_that_never_ends_is_refused():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(TooLargeError, match="/dev/zero: holds more than"):
        read_text_file("/dev/zero")
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 300 * 2**10


@given(st.lists(st.tuples(st.binary(max_size=40), st.integers(0, 60_000)), max_size=4))
def test_members_unfold_as_gzip_says_and_half_a_member_is_left_out(parts):
    texts = [part * repeated for part, repeated in parts]
    members = [gzip.compress(text) for text in texts]
    content = b"".join(members)
    found = list(gzip_members(content, "file"))
    assert [text for text, _ in found] == texts
    assert [end for _, end in found] == [sum(map(len, members[: number + 1])) for number in range(len(members))]
    if members:
        assert [text for text, _ in gzip_members(content[:-1], "file")] == texts[:-1]
