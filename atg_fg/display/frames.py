"""The camera frames of a trial as pictures beside its record: what was seen at each look, with what was detected.

A world with a camera offers ``camera_picture()``: its last frame with the detections drawn, RGB, shape
[height, width, 3].
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

from atg_fg.core.errors import InvalidInputError
from atg_fg.display import figures
from atg_fg.storage import plain_files
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
    """A folder beside a trial's record, named like it, with one PNG a look.

    Args:
        record: Path of the record, ``trial.jsonl`` for the folder ``trial.frames``.
        world: The world of the trial.

    Attributes:
        names: Path of each picture taken so far, from the record's folder; what the record says.

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
        self.names: list[str] = []

    def take(self, _step: object = None) -> None:
        """Save what the camera sees now; to be called at each look."""
        name = f"look-{len(self.names):03}.png"
        figures.save_image(camera_picture(self._world), self._folder / name)
        self.names.append(f"{self._folder.name}/{name}")
