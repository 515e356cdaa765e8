"""Crops beside the trials of a test: of each symbol that a trial shows, what shows it most surely.

A world that recognises objects by their looks offers ``crops``: what was cut out of its last frame for each slot, RGB,
shape [J, side, side, 3].
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.looks import surest_looks
from atg_fg.core.records import TrialStep, TrialSummary
from atg_fg.storage import plain_files

#: What such a world offers.
CROPS: Final = "crops"


class CropFolder:
    """A folder beside the log of a test, with no more than a PNG for each symbol of each trial.

    Args:
        log: The file, ``test-0000.jsonl.gz`` for the folder ``test-0000.crops``.
        world: The world of the test.

    Raises:
        InvalidInputError: The world has no crops, or the folder cannot be written.
        MissingDependencyError: OpenCV, which writes them, is not installed.
    """

    def __init__(self, log: Path, world: Any) -> None:
        from atg_fg.senses.opencv import png_of

        if not world.has_wrapper_attr(CROPS):
            raise InvalidInputError(f"crops: {world} offers no {CROPS}; expected a world of boxes with pictures")
        self._world, self._png_of = world, png_of
        self._folder = plain_files.make_folder(log.with_name(f"{log.name.partition('.')[0]}.crops"))
        self._pictures: list[list[bytes]] = []

    def take(self, _: TrialStep) -> None:
        """Keep what is seen now; to be called at each look."""
        self._pictures.append([self._png_of(crop) for crop in self._world.get_wrapper_attr(CROPS)])

    def save(self, number: int, trial: TrialSummary) -> TrialSummary:
        """Write the crops of a trial that has ended, and return what is kept of it, with their paths.

        Raises:
            InvalidInputError: The folder cannot be written.
        """
        pictures, self._pictures = self._pictures, []
        paths: list[list[str | None]] = [[None] * len(step.observed) for step in trial.steps]
        sure = [step.truth.get("confidences") or () for step in trial.steps]
        for look, slot in surest_looks(trial.detections, sure).values():
            path = self._folder / f"trial-{number:03}-look-{look:02}-{slot}.png"
            plain_files.write_bytes_atomically(path, pictures[look][slot])
            paths[look][slot] = f"{self._folder.name}/{path.name}"
        steps = [replace(step, crops=tuple(crops)) for step, crops in zip(trial.steps, paths, strict=True)]
        return replace(trial, steps=tuple(steps))
