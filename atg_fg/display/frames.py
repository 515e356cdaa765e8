"""The camera frames of a trial as pictures beside its record: what was seen at each look, with what was detected.

A world with a camera offers ``camera_picture()``: its last frame with the detections drawn, RGB, shape
[height, width, 3]. One that recognises objects by their looks offers ``crops``, too: what was cut out of that frame for
each slot, RGB, shape [J, side, side, 3].
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.records import TrialStep
from atg_fg.display import figures
from atg_fg.storage import plain_files
from atg_fg.storage.crop_folder import CROPS
from atg_fg.worlds.base import World

#: What a world with a camera offers.
CAMERA_PICTURE: Final = "camera_picture"


def has_camera(world: World) -> bool:
    """Whether a world offers pictures of what its camera sees."""
    return bool(world.has_wrapper_attr(CAMERA_PICTURE))


def camera_picture(world: World) -> Any:
    """Return the last camera frame of a world with the detections drawn, RGB, shape [height, width, 3].

    Raises:
        InvalidInputError: The world has no camera.
    """
    if not has_camera(world):
        raise InvalidInputError(f"frames: {world} offers no {CAMERA_PICTURE}(); expected a world with a camera")
    return world.get_wrapper_attr(CAMERA_PICTURE)()


class FrameFolder:
    """A folder beside a trial's record, named like it, with a PNG of each look, and of each slot where there are crops.

    Args:
        record: Path of the record, ``trial.jsonl`` for the folder ``trial.frames``.
        world: The world of the trial.

    Attributes:
        taken: What the record says of each look so far: paths of ``frame`` and ``crops``, from the record's folder.

    Raises:
        InvalidInputError: The world has no camera, or the folder cannot be written.
        MissingDependencyError: matplotlib, which writes the pictures, is not installed.
    """

    def __init__(self, record: Path, world: World) -> None:
        figures.figure_class()
        if not has_camera(world):
            camera_picture(world)
        self._world = world
        self._folder = plain_files.make_folder(record.with_suffix(".frames"))
        self.taken: list[dict[str, Any]] = []

    def take(self, step: TrialStep) -> None:
        """Save what the camera sees now, and crops where something was seen; to be called at each look."""
        look = f"look-{len(self.taken):03}"
        taken: dict[str, Any] = {"frame": self._save(camera_picture(self._world), look)}
        if self._world.has_wrapper_attr(CROPS):
            crops = self._world.get_wrapper_attr(CROPS)
            taken["crops"] = [
                None if symbol is None else self._save(crop, f"{look}-crop-{slot}")
                for slot, (symbol, crop) in enumerate(zip(step.detection, crops, strict=True))
            ]
        self.taken.append(taken)

    def _save(self, picture: Any, name: str) -> str:
        figures.save_image(picture, self._folder / f"{name}.png")
        return f"{self._folder.name}/{name}.png"
