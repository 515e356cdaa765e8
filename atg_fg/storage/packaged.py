"""What comes with this package: a robot memory, and results of experiments."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Any

from atg_fg.storage.checked_json import parse_json

_DATA = files("atg_fg.storage") / "data"
#: Where results lie in a checkout; a wheel has those that notebooks read beside the other data.
_RESULTS = Path(__file__).parents[2] / "results"


def example_memory() -> str:
    """Return a robot memory as JSON: ARcubes that were learned in 30 trials of 10 actions (`make example-memory`)."""
    return (_DATA / "cubes.json").read_text(encoding="utf-8")


def packaged_result(name: str) -> dict[str, Any]:
    """Return what a command wrote with ``--json`` when the experiments were run, such as ``ablation``.

    Raises:
        FileNotFoundError: No such result comes with the package.
    """
    packaged = _DATA / "results" / f"{name}.json"
    file = packaged if packaged.is_file() else _RESULTS / f"{name}.json"
    document: dict[str, Any] = parse_json(file.read_text(encoding="utf-8"), str(file))
    return document
