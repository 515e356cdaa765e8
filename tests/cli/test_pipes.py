"""What comes through a pipe is read as a file is, where a shell makes a path of a process."""

import os
import subprocess
import sys

import pytest

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
