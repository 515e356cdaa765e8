"""Cases run by the command line in a folder of their own, and told as transcripts."""

from __future__ import annotations

import contextlib
import gzip
import html.parser
import json
import platform
import re
import shlex
import shutil
import tempfile
from importlib.metadata import version
from pathlib import Path
from typing import Any, Final

import numpy as np
from typer.testing import CliRunner

from atg_fg.cli import app
from tests.unchanged.cases import COMMAND_WORDS, Case

DATA: Final = Path(__file__).parent / "data"
#: Folders of files that every case finds in its own.
_INPUTS: Final = (DATA / "inputs", Path(__file__).parent.parent / "data" / "formats")
#: A terminal of always the same kind.
_ENVIRONMENT: Final = {"COLUMNS": "100", "NO_COLOR": "1", "FORCE_COLOR": None, "TTY_COMPATIBLE": None}
_FLOAT: Final = re.compile(r"-?\b\d+(?:\.\d+(?:e[-+]?\d+)?|e[-+]?\d+)")


def transcript(case: Case) -> str:
    """Return what a case gives: each command, its standard output, its exit status if not 0, and its files."""
    told: list[str] = []
    with tempfile.TemporaryDirectory() as name, contextlib.chdir(name):
        for folder in _INPUTS:
            shutil.copytree(folder, name, dirs_exist_ok=True)
        for command in case.commands:
            result = CliRunner(env=_ENVIRONMENT).invoke(app, shlex.split(_as_today(command)), catch_exceptions=False)
            if result.exit_code not in (0, 1):
                raise RuntimeError(f"atg-fg {command}: {result.output}")
            told += [f"$ atg-fg {command}\n", _without(result.stdout, case.drop)]
            told += [f"[exit {result.exit_code}]\n"] if result.exit_code else []
        for output in case.outputs:
            told += [f"$ cat {output}\n", _content(Path(output))]
    return "".join(told)


def expected(case: Case) -> tuple[str, str]:
    """Return the transcript that was written down, and the machine that gave it."""
    machine, text = gzip.decompress(_place(case).read_bytes()).decode().split("\n", 1)
    return text, machine


def write_down(case: Case, text: str) -> None:
    """Write a transcript of this machine down."""
    _place(case).write_bytes(gzip.compress(f"{this_machine()}\n{text}".encode(), mtime=0))


def this_machine() -> str:
    """Return what the last digits of a sum depend on: the processor's instructions, and who adds."""
    instructions = np.show_config(mode="dicts")["SIMD Extensions"]["found"]
    return " ".join((platform.machine(), *(f"{each} {version(each)}" for each in ("numpy", "gtsam")), *instructions))


def same(found: str, written: str, machine: str) -> bool:
    """Return whether two transcripts are the same, byte for byte; from another machine, but for the last digits."""
    if found == written or machine == this_machine():
        return found == written
    if _FLOAT.sub("#", found) != _FLOAT.sub("#", written):
        return False
    numbers, others = (np.array(_FLOAT.findall(text), dtype=float) for text in (found, written))
    return np.allclose(numbers, others, rtol=1e-9, atol=1e-12)


def _place(case: Case) -> Path:
    return DATA / f"{case.name}.txt.gz"


def _as_today(command: str) -> str:
    for before, today in COMMAND_WORDS.items():
        if command.startswith(f"{before} "):
            return today + command.removeprefix(before)
    return command


def _without(output: str, drop: tuple[str, ...]) -> str:
    if not drop:
        return output
    document = json.loads(output, object_pairs_hook=lambda pairs: {key: v for key, v in pairs if key not in drop})
    return json.dumps(document, indent=1) + "\n"


def _content(file: Path) -> str:
    if file.suffix != ".html":
        return file.read_text()
    page = _Page()
    page.feed(file.read_text())
    return json.dumps({"data": page.data, "text": page.text}, indent=1, ensure_ascii=False) + "\n"


class _Page(html.parser.HTMLParser):
    """The JSON data in an HTML page, and the words in its tables and plots."""

    def __init__(self) -> None:
        super().__init__()
        self.data: Any = None
        self.text: list[str] = []
        self._open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag in ("table", "svg"):
            self._open.append(tag)
        if tag == "script":
            self._open.append("data" if dict(attrs).get("id") == "data" else "script")

    def handle_endtag(self, tag: str) -> None:
        if tag in ("table", "svg", "script"):
            self._open.pop()

    def handle_data(self, data: str) -> None:
        if self._open[-1:] == ["data"]:
            self.data = json.loads(data)
        elif self._open[-1:] in (["table"], ["svg"]) and data.strip():
            self.text.append(" ".join(data.split()))
