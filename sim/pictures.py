"""Pictures for people: the robot as it turns a cube or a box, as a strip and a film, and before three cubes."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray
from atg_fg.worlds.arcube import ACTION_SOURCES
from sim.vision.camera import Camera
from sim.worlds.film import observed
from sim.worlds.robonaut_arcube_world import RobonautARcubeWorld
from sim.worlds.robonaut_picture_box_world import RobonautPictureBoxWorld
from sim.worlds.robonaut_world import RobonautWorld
from sim.worlds.scene import Scene
from sim.worlds.stations_world import RobonautTableWorld

#: A picture is taken when the cube has turned by so much, degrees; the first one as the hands take hold.
_TURNED: Final = (30.0, 60.0)
_OBSERVER: Final = Camera((1.50, 0.95, 0.85), (0.21, 0.12, 0.40), 44.0, (420, 400))
#: Across the tables, as the paper's Figure 2 shows them.
_ACROSS: Final = Camera((2.10, 0.95, 0.98), (0.16, 0.0, 0.20), 42.0, (960, 560))
_MIDDLE: Final = 1  # the station
_GAP: Final = 4  # pixels


def draw_flip(seed: int = 0, urdf: Path | None = None, *, boxes: bool = False) -> NDArray[np.uint8]:
    """Return a flip as four pictures side by side, RGB, shape [height, width, 3]: grasp, two of the turn, the end.

    Args:
        seed: Of what is turned.
        urdf: A user's own description of the robot.
        boxes: Whether that is a box with pictures, not a cube with tags.
    """
    pictures: list[NDArray[np.uint8]] = []
    with closing(_world(boxes, urdf=urdf)) as world:
        world.reset(seed=seed)
        _, before = world.scene.cube.pose()

        def shoot() -> None:
            pictures.append(observed(world.scene, _OBSERVER))

        def shoot_if_held(phase: str) -> None:
            if phase == "lift":
                shoot()

        def shoot_if_turned() -> None:
            if 1 <= len(pictures) <= len(_TURNED) and _has_turned(world.scene, before, _TURNED[len(pictures) - 1]):
                shoot()

        world.manipulator.on_phase = shoot_if_held
        world.scene.on_step = shoot_if_turned
        world.step(np.int64(list(ACTION_SOURCES).index("flip")))
        shoot()
    gap = np.full((_OBSERVER.image_size[1], _GAP, 3), 255, dtype=np.uint8)
    row = [part for picture in pictures for part in (picture, gap)]
    return np.concatenate(row[:-1], axis=1)


def draw_actions(
    seed: int = 0, urdf: Path | None = None, *, boxes: bool = False
) -> tuple[list[NDArray[np.uint8]], int]:
    """Return a film of flip, left and right as RGB pictures, and how many there are a second; as for ``draw_flip``."""
    with closing(_world(boxes, urdf=urdf, render_mode="rgb_array_list")) as world:
        world.reset(seed=seed)
        for action in range(len(ACTION_SOURCES)):
            world.step(np.int64(action))
        return world.render(), int(world.metadata["render_fps"])


def draw_table(seed: int = 0, urdf: Path | None = None) -> NDArray[np.uint8]:
    """Return the robot before three cubes, in the midst of turning over the middle one, RGB, shape [560, 960, 3]."""
    pictures: list[NDArray[np.uint8]] = []
    with closing(RobonautTableWorld(urdf=urdf)) as world:
        world.reset(seed=seed)
        world.step(np.int64(len(ACTION_SOURCES) + _MIDDLE))
        _, before = world.scene.cube_pose()

        def shoot_if_turned() -> None:
            if not pictures and _has_turned(world.scene, before, _TURNED[0]):
                pictures.append(observed(world.scene, _ACROSS))

        world.scene.on_step = shoot_if_turned
        world.step(np.int64(list(ACTION_SOURCES).index("flip")))
        return pictures[0] if pictures else observed(world.scene, _ACROSS)


def _world(boxes: bool, **options: Any) -> RobonautWorld:
    return RobonautPictureBoxWorld(**options) if boxes else RobonautARcubeWorld(**options)


def _has_turned(scene: Scene, before: FloatArray, degrees: float) -> bool:
    """Whether the cube before the robot has turned by so much since its rotation matrix was ``before``."""
    cosine = (np.trace(scene.cube_pose()[1] @ before.T) - 1) / 2
    return bool(cosine < np.cos(np.radians(degrees)))
