"""The robot at work in a Rerun recording: robot, tables and cubes in 3D, and what the head's camera sees.

Entities: ``world/robot/LINK``, ``world/table_K``, ``world/cube_K``, ``world/camera``. The timeline ``time`` is
simulated seconds, going on from trial to trial.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from atg_fg.worlds.arcube import Cube
from sim.manipulation.impedance_control import TIME_STEP
from sim.vision.camera import Camera
from sim.worlds.rerun_entities import log_camera, log_cube, log_links, log_pose, log_shapes, log_world
from sim.worlds.scene import Scene

_POSES_A_SECOND: Final = 10
_EVERY: Final = max(1, round(1 / _POSES_A_SECOND / TIME_STEP))  # steps of the simulation


class SceneViewer:
    """Logs scenes, one after another.

    Args:
        recording: Rerun's ``RecordingStream``.
    """

    def __init__(self, recording: Any) -> None:
        self._recording = recording
        self._begun = 0.0
        self._scene: Scene | None = None
        log_world(recording)

    def begin(self, scene: Scene, cubes: Sequence[Cube], pictures: Sequence[NDArray[np.uint8]] | None = None) -> None:
        """Show a scene from now on, with these cubes one a station, and the pictures of symbols that are no tags."""
        if self._scene is not None:
            self._begun += self._scene.seconds
        else:
            self._show_bodies(scene)
        self._scene = scene
        self._set_time()
        for station, cube in enumerate(cubes):
            log_cube(self._recording, f"world/cube_{station}", cube, pictures)
        self._show_poses()
        before = scene.on_step

        def show() -> None:
            if before is not None:
                before()
            if scene.steps % _EVERY == 0:
                self._set_time()
                self._show_poses()

        scene.on_step = show

    def look(self, camera: Camera, picture: NDArray[np.uint8]) -> None:
        """Show where the head's camera is in the world, and what it sees, RGB, shape [height, width, 3]."""
        self._set_time()
        self._show_poses()
        log_camera(self._recording, camera, picture)

    def _set_time(self) -> None:
        seconds = self._begun + (0.0 if self._scene is None else self._scene.seconds)
        self._recording.set_time("time", duration=seconds)

    def _show_bodies(self, scene: Scene) -> None:
        """Log what stays the same in all scenes: the looks of the robot, and the tables."""
        with tempfile.TemporaryDirectory(prefix="robonaut-") as folder:
            # The meshes of the shell were written for PyBullet to read, and are gone.
            for name, content in scene.robot.model.meshes.items():
                (Path(folder) / name).write_text(content)
            log_shapes(self._recording, "world/robot", scene.client, scene.robot.body, Path(folder))
        for station, table in enumerate(scene.tables):
            log_shapes(self._recording, f"world/table_{station}", scene.client, table)
            log_links(self._recording, f"world/table_{station}", scene.client, table)

    def _show_poses(self) -> None:
        if self._scene is None:
            return
        log_links(self._recording, "world/robot", self._scene.client, self._scene.robot.body)
        for station, cube in enumerate(self._scene.cubes):
            log_pose(self._recording, f"world/cube_{station}", *cube.pose())
