"""Pipes in place of files: what comes through one is read as a file is, and no one waits for ever at an end of one."""

import fcntl
import os
import stat
import struct
import subprocess
import sys
import termios
import threading
import time
from contextlib import ExitStack

import pytest

from atg_fg.storage import named_pipes, plain_files
from tests.cli.test_endings import begin, interrupted
from tests.cli.test_paths import PATHS, arguments
from tests.dask_cluster import wait_for
from tests.torture import commands
from tests.torture.originals import originals

#: Commands, with the file that comes through a pipe in place of each {}, by kind.
COMMANDS = {
    "memory show {} --json -": ("memory",),
    "memory check {} --json -": ("database",),
    "memory compact {} --output OUT/m.npz": ("structured memory",),
    "memory import {} {} --into OUT/robot.db": ("test log", "memory"),
    "trial --memory {} --actions 1 --engine bayes-filter": ("memory",),
    "replay {}": ("script",),
    "uai solve {} --evidence {} --task MAR": ("UAI model", "UAI evidence"),
    "report {} -o OUT/page.html": ("trial record",),
    "report {} -o OUT/log.html": ("test log",),
    "sim calibrate {} --output OUT/preset.json": ("counts",),
}


@pytest.mark.skipif(not os.path.exists("/dev/fd"), reason="no /dev/fd")
@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_gives_of_a_pipe_what_it_gives_of_a_file(run, tmp_path, command):
    said = []
    for folder in ("files", "pipes"):
        (tmp_path / folder).mkdir()
        paths = []
        for number, kind in enumerate(COMMANDS[command]):
            suffix = ".jsonl.gz" if kind == "test log" else ""
            paths.append(tmp_path / folder / f"given-{number}{suffix}")
            paths[-1].write_bytes(originals()[kind][0])
        with ExitStack() as pipes:
            if folder == "pipes":
                cats = [subprocess.Popen(["cat", path], stdout=subprocess.PIPE) for path in paths]
                paths = [f"/dev/fd/{pipes.enter_context(cat).stdout.fileno()}" for cat in cats]
            status, output, _ = run(*command.format(*paths).replace("OUT", str(tmp_path / folder)).split())
        lines = [line for line in output.splitlines() if str(tmp_path) not in line and "/dev/fd" not in line]
        made = sorted(path.name for path in (tmp_path / folder).iterdir() if not path.name.startswith("given"))
        said.append((status, lines, made))
    assert said[0] == said[1]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")
@pytest.mark.parametrize(
    "command",
    ["memory show {}", "memory import {} --into OUT", "report {}", "replay {}", "uai solve {} --task MAR",
     "rescore {} --preset default", "trial --memory {}", "sim calibrate {} --output OUT"],
)  # fmt: skip
def test_a_pipe_to_which_no_one_writes_is_given_up(refused, tmp_path, monkeypatch, command):
    monkeypatch.setattr(named_pipes, "PIPE_WAIT", 0.1)
    os.mkfifo(tmp_path / "pipe")
    words = [word.format(tmp_path / "pipe").replace("OUT", str(tmp_path / "out")) for word in command.split()]
    assert "a pipe to which no one writes for 0.1 s; expected a file" in refused(*words)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")
def test_one_who_writes_to_a_pipe_may_take_their_time(tmp_path, monkeypatch):
    monkeypatch.setattr(named_pipes, "PIPE_WAIT", 0.2)
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    content = os.urandom(3 * 2**20)

    def write():
        with pipe.open("wb") as file:  # begins at once, and writes after more than that time
            time.sleep(0.5)
            file.write(content)

    writer = threading.Thread(target=write)
    writer.start()
    assert plain_files.read_bytes_file(pipe) == content
    writer.join(10)


#: Each command that writes, with each of the files that it makes.
MADE = [
    (command.words, word[1:])
    for command in commands.COMMANDS
    for word in command.words.split()
    if word.startswith("@") and word[1:] not in commands.FILES
]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")
class TestPipeThatNoOneReads:
    @pytest.mark.slow
    @pytest.mark.parametrize(("words", "made"), MADE, ids=str)
    def test_each_output_of_each_command_is_given_up(self, tmp_path, monkeypatch, words, made):
        monkeypatch.setattr(named_pipes, "PIPE_WAIT", 0.1)
        pipe = commands.prepared(tmp_path / "work") / made
        os.mkfifo(pipe)
        begun = time.monotonic()
        status, error = commands.run(words, pipe.parent)
        assert time.monotonic() - begun < 60
        lines = [line for line in error.splitlines() if "compiling loops" not in line]
        assert (status, len(lines)) == (2, 1)
        assert f"{pipe}: " in error
        assert "; expected " in error
        assert stat.S_ISFIFO(pipe.stat().st_mode)
        assert not [path for path in pipe.parent.iterdir() if path.name.startswith(".")]

    def test_the_one_line_says_how_long_a_reader_was_waited_for(self, tmp_path, monkeypatch, refused):
        monkeypatch.setattr(named_pipes, "PIPE_WAIT", 0.1)
        os.mkfifo(tmp_path / "pipe")
        error = refused("memory", "example", tmp_path / "pipe")
        assert "pipe: a pipe from which no one reads for 0.1 s; expected a file, or a pipe with a reader" in error

    def test_a_reader_may_come_a_little_later(self, tmp_path):
        os.mkfifo(tmp_path / "pipe")
        writer = threading.Thread(target=plain_files.write_bytes_atomically, args=(tmp_path / "pipe", b"x" * 10**6))
        writer.start()
        time.sleep(0.2)
        assert (tmp_path / "pipe").read_bytes() == b"x" * 10**6
        writer.join(10)

    @pytest.mark.skipif(sys.platform != "linux", reason="asks how full a pipe is")
    def test_ctrl_c_ends_a_command_whose_reader_does_not_read(self, tmp_path):
        os.mkfifo(tmp_path / "pipe")
        reader = os.open(tmp_path / "pipe", os.O_RDONLY | os.O_NONBLOCK)
        fcntl.fcntl(reader, fcntl.F_SETPIPE_SZ, 4096)  # less than a memory
        process = begin("memory", "example", tmp_path / "pipe", stdout=subprocess.DEVNULL)

        def is_full():
            return struct.unpack("i", fcntl.ioctl(reader, termios.FIONREAD, bytes(4)))[0] > 0

        wait_for(is_full)
        assert interrupted(process) == (130, "")
        os.close(reader)


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")
@pytest.mark.parametrize(
    ("name", "path"), [(name, path.name) for name, paths in PATHS.items() for path in paths if not path.written]
)
def test_no_input_of_a_command_is_waited_for(tmp_path, monkeypatch, refused, name, path):
    monkeypatch.setattr(named_pipes, "PIPE_WAIT", 0.1)
    os.mkfifo(tmp_path / "pipe")
    begun = time.monotonic()
    refused(*arguments(name, **{path: tmp_path / "pipe"}))
    assert time.monotonic() - begun < 60
