"""How commands end where they are interrupted, where nobody reads what they print, and where it cannot be printed."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.dask_cluster import ROOT, wait_for
from tests.process_groups import descendants, nobody_left

linux = pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")
COMMANDS = {
    "help": ["--help"],
    "table": ["memory", "show", "memory.json"],
    "JSON": ["memory", "show", "memory.json", "--json", "-"],
    "help of a command": ["table1", "--help"],
    "lines": ["memory", "check", "memory.json"],
}


#: Commands, and whether their output is buffered, that stand for all.
QUICK = (("help", False), ("table", True))


def begin(*arguments, **options):
    """Begin the program in a process group of its own, as a terminal does, which leaves SIGINT to it."""
    return subprocess.Popen(
        [sys.executable, "-c", "from atg_fg_program import main; main()", *map(str, arguments)],
        env={**os.environ, "PYTHONPATH": str(ROOT), **options.pop("environment", {})},
        stderr=subprocess.PIPE, start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        **options,
    )  # fmt: skip


def interrupted(process):
    """Send Ctrl-C as a terminal does; return the exit status and standard error when all processes have gone."""
    os.killpg(process.pid, signal.SIGINT)
    _, error = process.communicate(timeout=60)
    wait_for(lambda: nobody_left(process.pid))
    return process.returncode, error.decode()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("endings")
    assert begin("memory", "example", "memory.json", cwd=made, stdout=subprocess.DEVNULL).communicate() == (None, b"")
    return made


@pytest.mark.parametrize(
    ("command", "buffered"),
    [
        *QUICK,
        *(
            pytest.param(command, buffered, marks=pytest.mark.slow)
            for command in COMMANDS for buffered in (True, False) if (command, buffered) not in QUICK
        ),
    ],
)  # fmt: skip
class TestOutput:
    def test_a_pipe_that_nobody_reads_ends_a_command_quietly(self, command, buffered, folder):
        read, write = os.pipe()
        os.close(read)
        environment = {"PYTHONUNBUFFERED": "" if buffered else "1"}
        process = begin(*COMMANDS[command], cwd=folder, stdout=write, environment=environment)
        os.close(write)
        assert (process.communicate()[1], process.returncode) == (b"", 141)

    @pytest.mark.skipif(not os.path.exists("/dev/full"), reason="there is no /dev/full")
    def test_a_full_standard_output_is_one_line(self, command, buffered, folder):
        environment = {"PYTHONUNBUFFERED": "" if buffered else "1"}
        with open("/dev/full", "wb") as full:
            process = begin(*COMMANDS[command], cwd=folder, stdout=full, environment=environment)
        error = process.communicate()[1].decode()
        assert (error, process.returncode) == ("atg-fg: standard output: No space left on device\n", 2)


@pytest.mark.parametrize(
    "encoding", ["ascii", *(pytest.param(each, marks=pytest.mark.slow) for each in ("latin-1", "utf-8"))]
)
def test_what_an_encoding_does_not_know_is_written_out(encoding, folder):
    name = os.fsdecode(b"caf\xc3\xa9-\xff.json")
    (folder / name).write_bytes((folder / "memory.json").read_bytes())
    process = begin(
        "memory", "show", name, cwd=folder, stdout=subprocess.PIPE, environment={"PYTHONIOENCODING": encoding}
    )
    output, error = process.communicate()
    assert (error, process.returncode) == (b"", 0)
    assert "caf" in output.decode(encoding)
    assert "\\udcff.json: 25 of 100 objects" in output.decode(encoding)


@linux
@pytest.mark.parametrize(
    "loaded",
    ["_datetime", "gtsam", *(pytest.param(each, marks=pytest.mark.slow) for each in ("_multiarray_umath", "_sqlite3"))],
)
def test_ctrl_c_ends_a_command_while_it_loads_libraries(loaded, folder):
    process = begin("table1", "--tests", "1", "--jobs", "1", cwd=folder, stdout=subprocess.DEVNULL)
    wait_for(lambda: loaded in Path(f"/proc/{process.pid}/maps").read_text())
    assert interrupted(process) == (130, "")


@linux
def test_ctrl_c_ends_the_robots_workers(folder):
    pytest.importorskip("pybullet")
    process = begin("sim", "reliability", "--actions", "200", "--jobs", "2", cwd=folder, stdout=subprocess.DEVNULL)
    wait_for(lambda: len(descendants(process.pid)) >= 4)  # two workers, what forks them, what tracks their resources
    begun = time.monotonic()
    assert interrupted(process) == (130, "")
    assert time.monotonic() - begun < 20  # two seconds, on a machine with nothing else to do
