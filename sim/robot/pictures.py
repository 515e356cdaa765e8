"""Pictures for people: the robot as it flips a cube, and a film of its three actions."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from atg_fg.arcube import ACTION_SOURCES
from sim.camera import Camera
from sim.robot.film import observed
from sim.robot.world import RobonautARcubeWorld

#: A picture is taken when the cube has turned by so much, degrees; the first one as the hands take hold.
_TURNED: Final = (30.0, 60.0)
_OBSERVER: Final = Camera((1.50, 0.95, 0.85), (0.21, 0.12, 0.40), 44.0, (420, 400))
_GAP: Final = 4  # pixels


def draw_flip(seed: int = 0, urdf: Path | None = None) -> NDArray[np.uint8]:
    """Return a flip as four pictures side by side, RGB, shape [height, width, 3]: grasp, two of the turn, the end."""
    pictures: list[NDArray[np.uint8]] = []
    with closing(RobonautARcubeWorld(urdf=urdf)) as world:
        world.reset(seed=seed)
        _, before = world.scene.cube.pose()

        def shoot() -> None:
            pictures.append(observed(world.scene, _OBSERVER))

        def shoot_if_held(phase: str) -> None:
            if phase == "lift":
                shoot()

        def shoot_if_turned() -> None:
            cosine = (np.trace(world.scene.cube.pose()[1] @ before.T) - 1) / 2
            if 1 <= len(pictures) <= len(_TURNED) and cosine < np.cos(np.radians(_TURNED[len(pictures) - 1])):
                shoot()

        world.manipulator.on_phase = shoot_if_held
        world.scene.on_step = shoot_if_turned
        world.step(np.int64(list(ACTION_SOURCES).index("flip")))
        shoot()
    gap = np.full((_OBSERVER.image_size[1], _GAP, 3), 255, dtype=np.uint8)
    row = [part for picture in pictures for part in (picture, gap)]
    return np.concatenate(row[:-1], axis=1)


def draw_actions(seed: int = 0, urdf: Path | None = None) -> tuple[list[NDArray[np.uint8]], int]:
    """Return a film of flip, left and right as RGB pictures, and how many there are a second."""
    with closing(RobonautARcubeWorld(urdf=urdf, render_mode="rgb_array_list")) as world:
        world.reset(seed=seed)
        for action in range(len(ACTION_SOURCES)):
            world.step(np.int64(action))
        return world.render(), int(world.metadata["render_fps"])
