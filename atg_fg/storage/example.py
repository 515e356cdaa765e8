"""The memory that comes with this package."""

from __future__ import annotations

from importlib.resources import files


def example_memory() -> str:
    """Return a robot memory as JSON: ARcubes that were learned in 30 trials of 10 actions (`make example-memory`)."""
    return files("atg_fg.storage").joinpath("data", "cubes.json").read_text(encoding="utf-8")
