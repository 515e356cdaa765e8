"""Every command that writes, on a disk that is full: one line, no half of a file, and it can be run again or gone on.

A command is run with room first. Without room each file that it leaves must be as it was, as it should be, or a log
that holds a part of what it should; a database must be sound. With room again it must come to what it should be.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple, Protocol

from atg_fg import cli
from atg_fg.core.errors import AtgError
from atg_fg.storage import memory_files, memory_json
from atg_fg.storage.database.checking import faults_of_database
from atg_fg.storage.database.memory_reading import database_holds_memory
from atg_fg.storage.database.trial_log import read_stored_trials
from atg_fg.storage.packaged import example_memory
from atg_fg.storage.trial_log import to_line
from tests.torture.originals import originals

#: Files that there are before a command begins: those of a kind of the originals, and two more.
_KINDS: Final = {
    "memory.json": "memory",
    "structured.json": "structured memory",
    "robot.db": "database",
    "script.json": "script",
    "model.uai": "UAI model",
    "record.jsonl": "trial record",
    "test.jsonl.gz": "test log",
    "counts.json": "counts",
    "looks.csv": "recorded table",
    "tag.png": "picture",
}
FILES: Final = frozenset({*_KINDS, "example.json", "plain.json"})
#: Bytes that are left on the disk when a command begins.
LEFT = (0, 4096, 20_480, 69_632)


class Disk(Protocol):
    """A disk that can be filled up."""

    folder: Path

    def full(self, left: int) -> Any: ...


class Command(NamedTuple):
    """A command that writes.

    Attributes:
        words: Of the command line; a name with ``@`` before it is a file of its folder.
        again: Words to add when it is run again.
    """

    words: str
    again: str = ""


_QUICK = "--engine bayes-filter --jobs 1 --trials 4 --tests 1"
COMMANDS = (
    Command("trial --engine bayes-filter --actions 2 --save-memory @m.json --record @r.jsonl --json @j.json"),
    Command("trial --engine bayes-filter --actions 2 --save-memory @new.db"),
    Command("trial --engine bayes-filter --actions 2 --memory @plain.json --save-memory @m.npz"),
    Command("trial --engine bayes-filter --actions 2 --memory @robot.db --save-memory @robot.db"),
    Command(f"table1 {_QUICK} --actions 2 --records @records --save-memories @memories --json @j.json", "--resume"),
    Command(f"table1 {_QUICK} --actions 2 --records @tests.db --json @j.json", "--resume"),
    Command(f"figure3 {_QUICK} --actions 2 --log @log.jsonl --csv @points.csv --plot @plot.svg --json @j.json"),
    Command(
        "ablation --jobs 1 --trials 3 --tests 2 --actions 2 --variants default --noises ideal --worlds ideal "
        "--log @log.jsonl --plot @plot.png --json @j.json"
    ),
    Command(
        "goal --engine bayes-filter --jobs 1 --trials 2 --cubes 1 --memory-cubes 2 --learning-actions 0 "
        "--records @records --json @j.json",
        "--resume",
    ),
    Command("rescore @test.jsonl.gz --preset default --json @j.json"),
    Command("learn @looks.csv --memory @m.json --objects 4 --json @j.json"),
    Command("learn @looks.csv --memory @m.db --objects 4 --json @j.json"),
    Command("recognise @looks.csv --memory @m.json --objects 4 --learn --report @page.html --json @j.json"),
    Command("recordings check @looks.csv --json @j.json"),
    Command("recordings convert @looks.csv --output @looks.jsonl --objects 4"),
    Command("recordings simulate --output @made.csv --trials 4 --actions 2"),
    Command("explain @script.json --json @j.json"),
    Command("uai export @script.json --model @m.uai --evidence @e.evid"),
    Command("uai solve @model.uai --task MAR --json @j.json"),
    Command("report @record.jsonl -o @page.html"),
    Command("report @robot.db -o @page.html"),
    Command("memory show @robot.db --json @j.json"),
    Command("memory check @memory.json --json @j.json"),
    Command("memory export @structured.json --format graphml --output @g.graphml"),
    Command("memory export @robot.db --format trials --output @t.jsonl"),
    Command("memory import @test.jsonl.gz @plain.json --into @into.db"),
    Command("memory merge @plain.json @robot.db -o @union.json"),
    Command("memory merge @plain.json @robot.db -o @union.db"),
    Command("memory diff @plain.json @structured.json --json @j.json"),
    Command("memory repair @robot.db --json @j.json"),
    Command("memory compact @plain.json --output @m.npz --json @j.json"),
    Command("memory duplicates @memory.json --merge --json @j.json"),
    Command("memory unmerge @memory.json object-003"),
    Command("memory example @m.json"),
    Command("memory structure @example.json --plot @plot.png --json @j.json"),
    Command("sim calibrate @counts.json --output @preset.json --json @j.json"),
    Command("print board -o @board.pdf"),
    Command("print cube --cubes 1 -o @cube.pdf --json @j.json"),
    Command("look @tag.png --dictionary 5X5_50 --draw @seen --json @j.json"),
    Command("engines check --engine bayes-filter --trials 2 --json @j.json"),
    Command("demo --world ideal --actions 1 --engine bayes-filter --output @out --json @j.json"),
)


def command_outcomes(disk: Disk, n_points: int, n_commands: int | None = None) -> Iterator[tuple[str, str | None]]:
    """Yield the name of each command that is run on a full disk, and what is wrong if anything is."""
    for command in COMMANDS[:n_commands]:
        name = " ".join(command.words.split()[: 1 + (command.words.split()[0] in cli_groups())])
        folder = disk.folder / "work"
        status, error = run(command.words, prepared(folder))
        if status not in (0, 1):
            yield name, f"cannot be run at all: {error}"
            continue
        reference = _snapshot(folder)
        for left in LEFT[:n_points]:
            fault = _fault(command, disk, left, reference)
            yield name, None if fault is None else f"{command.words}, {left} bytes left: {fault}"
        shutil.rmtree(folder)


def cli_groups() -> tuple[str, ...]:
    """The words after which another one follows."""
    return "memory", "uai", "sim", "print", "recordings", "engines"


def prepared(folder: Path) -> Path:
    """Make a folder anew with all files that the commands read, and return it."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    sound = originals()
    for name, kind in _KINDS.items():
        (folder / name).write_bytes(sound[kind][0])
    document = json.loads(sound["memory"][0])
    document.pop("merges", None)
    (folder / "example.json").write_text(example_memory())
    (folder / "plain.json").write_text(json.dumps(document))
    return folder


def _fault(command: Command, disk: Disk, left: int, reference: dict[str, Any]) -> str | None:
    folder = prepared(disk.folder / "work")
    before = _snapshot(folder)
    with disk.full(left):
        status, error = run(command.words, folder)
    after = _snapshot(folder)
    if "Traceback" in error or status not in (0, 1, 2):
        return f"status {status}: {error[-300:]}"
    if status == 2:
        if error.count("\n") != 1 or not any(word in error for word in ("cannot be written", "cannot be opened")):
            return f"said {error[:300]!r}"
        for name, content in after.items():
            if content != before.get(name) and not _is_part(content, reference.get(name)):
                return f"{name} is neither as it was nor as it should be"
        status, error = run(f"{command.words} {command.again}", folder)
        if status == 2 and "already there" in error:  # whole, as was just seen
            return None
        if status not in (0, 1):
            return f"with room again: {error[:300]}"
        after = _snapshot(folder)
    different = [name for name in reference.keys() | after.keys() if reference.get(name) != after.get(name)]
    return f"with room: {', '.join(different)} not as it should be" if different else None


def _is_part(content: Any, whole: Any) -> bool:
    """Return whether a file is as it should be, or a log or a database with some of what it should hold."""
    if content == whole or content in (b"", None):
        return True
    if isinstance(content, tuple) and isinstance(whole, tuple):
        return not content[0] and content[2] == whole[2][: len(content[2])]
    return isinstance(content, bytes) and isinstance(whole, bytes) and whole.startswith(content)


def _snapshot(folder: Path) -> dict[str, Any]:
    """Return what each file holds; of a database its faults, memory and trials."""
    found: dict[str, Any] = {}
    for path in sorted(folder.rglob("*")):
        name = str(path.relative_to(folder))
        if path.is_dir() or name.endswith(("-wal", "-shm", "-journal")):
            continue
        found[name] = _database(path) if path.suffix == ".db" else path.read_bytes()
    return found


def _database(path: Path) -> Any:
    if not path.stat().st_size:
        return None
    try:
        faults = faults_of_database(path)
        holds = database_holds_memory(path)
        memory = memory_json.memory_to_json(memory_files.load_memory(path)) if holds else None
        return tuple(faults), memory, tuple(json.dumps(to_line(trial)) for trial in read_stored_trials(path))
    except AtgError as error:
        return None if "an empty database" in str(error) else ((str(error),), None, ())


def run(words: str, folder: Path) -> tuple[int, str]:
    """Run a command in a process of its own, forked from this warm one; return its status and standard error."""
    reading, writing = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(reading)
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, 1)
        os.dup2(writing, 2)
        sys.stdout, sys.stderr = open(1, "w", closefd=False), open(2, "w", closefd=False)  # noqa: SIM115
        sys.argv = ["atg-fg", *(str(folder / word[1:]) if word.startswith("@") else word for word in words.split())]
        status = 3
        try:
            cli.main()
        except SystemExit as left:
            status = left.code if isinstance(left.code, int) else 0 if left.code is None else 3
        except BaseException:
            import traceback

            traceback.print_exc()
        finally:
            sys.stderr.flush()
            os._exit(status)
    os.close(writing)
    with open(reading, encoding="utf-8", errors="replace") as pipe:
        error = pipe.read()
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), error
