"""The tour of commands in ``docs/tour.md``: ``python docs/tour.py`` runs them and writes down what they print.

A command is a line of a console block that begins with ``$``; what follows are the first lines of its output. Where the
block says ``...`` after them, as many lines are kept as there were, or eight; what follows the dots are the last lines.
The processor time of each, in seconds, is written behind the block that it stands in.
"""

from __future__ import annotations

import os
import re
import resource
import shlex
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]
PAGE: Final = ROOT / "docs" / "tour.md"
CUT: Final = "..."
_BLOCK: Final = re.compile(r"```console\n(?P<text>.*?)```\n(?P<times>\n\*Takes [^*]+\*\n)?", re.DOTALL)
#: A terminal of always the same kind.
ENVIRONMENT: Final = {"COLUMNS": "110", "NO_COLOR": "1", "TERM": "dumb"}


@dataclass
class Command:
    """A command of the tour, the first lines of its output, and the last ones; ``cut`` if there are others between."""

    line: str
    output: list[str]
    cut: bool = False
    end: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        return "\n".join([f"$ {self.line}", *self.output, *([CUT] if self.cut else []), *self.end])

    def shown(self, lines: list[str]) -> tuple[list[str], list[str]]:
        """Return what the page shows of the lines that the command prints: the first, and the last."""
        if not self.cut:
            return lines, []
        return lines[: len(self.output) or 8], lines[len(lines) - len(self.end) :]


def commands_in(block: str) -> list[Command]:
    """Return the commands in the text of a console block."""
    found: list[Command] = []
    for line in block.splitlines():
        if line.startswith("$ "):
            found.append(Command(line.removeprefix("$ "), []))
        elif line == CUT:
            found[-1].cut = True
        else:
            (found[-1].end if found[-1].cut else found[-1].output).append(line)
    return found


def commands() -> list[Command]:
    """Return all commands of the page, in their order."""
    return [each for block in _BLOCK.finditer(PAGE.read_text()) for each in commands_in(block["text"])]


def run(line: str, folder: Path, *more: str) -> subprocess.CompletedProcess[str]:
    """Run a command in a folder, with more options behind it."""
    program, *arguments = shlex.split(line)
    return subprocess.run(
        [Path(sys.executable).with_name(program), *arguments, *more],
        cwd=folder,
        env={**os.environ, **ENVIRONMENT},
        capture_output=True,
        text=True,
        check=False,
    )


def printed(output: str) -> list[str]:
    """Return lines as the page has them: without spaces at their end."""
    return [line.rstrip() for line in output.rstrip().splitlines()]


def make_folder(folder: Path) -> None:
    """Put what the commands read beside what they make."""
    (folder / "tests").symlink_to(ROOT / "tests")


def _processor_time() -> float:
    """Return the seconds that processors have spent on all commands so far; other work on the machine adds little."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _written(block: re.Match[str], folder: Path) -> str:
    """Run the commands of a block and return it with what they print."""
    found, times = commands_in(block["text"]), []
    for command in found:
        begun = _processor_time()
        done = run(command.line, folder)
        times.append(max(1, round(_processor_time() - begun)))
        if done.returncode:
            sys.exit(f"{command.line}: {done.stderr}")
        command.output, command.end = command.shown(printed(done.stdout))
        print(f"{times[-1]:4} s  {command.line}", flush=True)
    text = "\n".join(map(str, found))
    return f"```console\n{text}\n```\n\n*Takes {' + '.join(map(str, times))} s.*\n"


def main() -> None:
    """Run all commands and write the page anew."""
    with tempfile.TemporaryDirectory() as name:
        make_folder(Path(name))
        PAGE.write_text(_BLOCK.sub(lambda block: _written(block, Path(name)), PAGE.read_text()))


if __name__ == "__main__":
    main()
