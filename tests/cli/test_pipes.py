"""What comes through a pipe is read as a file is, where a shell makes a path of a process."""

import os
import subprocess
import sys
import threading
import time

import pytest

from atg_fg.storage import plain_files
from tests.cli.conftest import refused as refused  # a fixture
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
def test_a_command_gives_of_a_pipe_what_it_gives_of_a_file(tmp_path, command):
    said = []
    for folder, form in (("files", "{}"), ("pipes", "<(cat {})")):
        (tmp_path / folder).mkdir()
        paths = []
        for number, kind in enumerate(COMMANDS[command]):
            suffix = ".jsonl.gz" if kind == "test log" else ""
            paths.append(tmp_path / folder / f"given-{number}{suffix}")
            paths[-1].write_bytes(originals()[kind][0])
        words = command.replace("{}", form).format(*paths).replace("OUT", str(tmp_path / folder))
        script = f'"$0" -c "from atg_fg.cli import main; main()" {words}'
        done = subprocess.run(["bash", "-c", script, sys.executable], capture_output=True, text=True, check=False)
        assert "Traceback" not in done.stderr
        lines = [line for line in done.stdout.splitlines() if str(tmp_path) not in line and "/dev/fd" not in line]
        made = sorted(path.name for path in (tmp_path / folder).iterdir() if not path.name.startswith("given"))
        said.append((done.returncode, lines, made))
    assert said[0] == said[1]


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")
@pytest.mark.parametrize(
    "command",
    ["memory show {}", "memory import {} --into OUT", "report {}", "replay {}", "uai solve {} --task MAR",
     "rescore {} --preset default", "trial --memory {}", "sim calibrate {} --output OUT"],
)  # fmt: skip
def test_a_pipe_to_which_no_one_writes_is_given_up(refused, tmp_path, monkeypatch, command):
    monkeypatch.setattr(plain_files, "PIPE_WAIT", 0.1)
    os.mkfifo(tmp_path / "pipe")
    words = [word.format(tmp_path / "pipe").replace("OUT", str(tmp_path / "out")) for word in command.split()]
    assert "a pipe to which no one writes for 0.1 s; expected a file" in refused(*words)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no named pipes")
def test_one_who_writes_to_a_pipe_may_take_their_time(tmp_path, monkeypatch):
    monkeypatch.setattr(plain_files, "PIPE_WAIT", 0.2)
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
