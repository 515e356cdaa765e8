"""Pictures of the robot at work, seen by an observer, with what the robot sees in a corner."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from sim.manipulation.impedance_control import TIME_STEP
from sim.vision.camera import Camera, Light
from sim.worlds.scene import Scene

#: Beside the table, looking at a robot at the world's origin.
OBSERVER: Final = Camera((1.50, 0.90, 0.95), (0.17, 0.02, 0.41), 42.0, (480, 360))
_LIGHT: Final = Light((1.2, 0.9, 2.2), ambient=0.55, diffuse=0.45)
_INSET_SHARE: Final = 0.3
_BORDER: Final = 2  # pixels
#: Films show the robot faster than it is.
SPEED: Final = 4.0


def observer_of(n_stations: int) -> Camera:
    """Return a camera that has a whole row of stations in view, wherever the robot is, with room for an inset."""
    if n_stations == 1:
        return OBSERVER
    eye = (1.30 + 0.40 * n_stations, 0.15 + 0.10 * n_stations, 0.80 + 0.10 * n_stations)
    return Camera(eye, (0.15, 0.0, 0.30 + 0.08 * n_stations), 51.0 + 1.4 * n_stations, (480, 360))


def observed(scene: Scene, camera: Camera) -> NDArray[np.uint8]:
    """Return what an observer sees, RGB, shape [height, width, 3]."""
    with scene.floor_in_sight():
        return camera.render(scene.client, _LIGHT, shadow=True)


def with_inset(picture: NDArray[np.uint8], inset: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a picture with a smaller one in its upper left corner."""
    height = int(picture.shape[0] * _INSET_SHARE)
    width = height * inset.shape[1] // inset.shape[0]
    rows = (np.arange(height) * inset.shape[0]) // height
    columns = (np.arange(width) * inset.shape[1]) // width
    both = picture.copy()
    both[: height + 2 * _BORDER, : width + 2 * _BORDER] = 40
    both[_BORDER : height + _BORDER, _BORDER : width + _BORDER] = inset[rows][:, columns]
    return both


class Film:
    """Takes a picture of a scene at regular simulated times.

    Args:
        fps: Pictures a second of film; a second of film is ``SPEED`` seconds of simulated time.
    """

    def __init__(self, fps: int) -> None:
        self._every = max(1, round(SPEED / fps / TIME_STEP))
        self._pictures: list[NDArray[np.uint8]] = []

    def begin(
        self, scene: Scene, inset: Callable[[], NDArray[np.uint8]], observer: Callable[[], Camera] = lambda: OBSERVER
    ) -> None:
        """Film a scene from now on as ``observer`` sees it, with the picture that ``inset`` returns in the corner."""

        def shoot() -> None:
            if scene.steps % self._every == 0:
                self._pictures.append(with_inset(observed(scene, observer()), inset()))

        scene.on_step = shoot

    def take(self) -> list[NDArray[np.uint8]]:
        """Return the pictures taken since the last time, and forget them."""
        pictures, self._pictures = self._pictures, []
        return pictures
