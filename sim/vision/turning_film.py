"""A webcam's film of a person who turns a cube by hand: a lens that bends lines, light that wanders, blur, hands.

For trying what looks through real cameras where there is none. Nothing is simulated but the picture: the cube is moved
along the path of a turn. Frame: x points away from the camera, y to its left, z up.
"""

from __future__ import annotations

import tempfile
import weakref
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Final

import cv2
import numpy as np
import pybullet
from numpy.typing import NDArray

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray
from atg_fg.storage.plain_files import write_bytes_atomically
from atg_fg.worlds.arcube import ACTION_ROTATIONS
from sim.bodies.cube import CUBE_CENTRE, CUBE_SIZE, CubeBody
from sim.vision.camera import Camera, Light

#: A film's formats by the suffix of its file.
CODECS: Final = {".avi": "MJPG", ".mp4": "mp4v"}
#: While nothing but the light moves, it is rendered anew once in so many frames.
_FRAMES_A_SHOT: Final = 3
_SKIN: Final = [0.85, 0.63, 0.50, 1.0]
_AWAY: Final = np.array([0.0, 5.0, 0.0])  # where a hand is that is not needed


@dataclass(frozen=True)
class Webcam:
    """What an ordinary webcam does to a picture.

    Attributes:
        image_size: (width, height), pixels.
        distortion: Of the lens, as OpenCV has it.
        pitch: How far it looks down, degrees.
        field_of_view: Vertical, degrees.
        noise: Standard deviation of each grey level, 0 to 255.
        exposure: Share of the time between frames in which a moving cube is blurred.
        light_period: Seconds in which the lamp goes once around.
        rate: Frames a second.
    """

    image_size: tuple[int, int] = (400, 300)
    distortion: tuple[float, ...] = (-0.22, 0.06, 0.001, -0.001, 0.0)
    pitch: float = 38.0
    field_of_view: float = 36.0
    noise: float = 4.0
    exposure: float = 0.4
    light_period: float = 5.0
    rate: float = 10.0

    @cached_property
    def camera(self) -> Camera:
        """An ideal camera where the webcam is, that sees a little more than it."""
        radians = np.radians(self.pitch)
        eye = CUBE_CENTRE + 1.2 * np.array([-np.cos(radians), 0.0, np.sin(radians)])
        return Camera(
            eye=tuple(eye.tolist()),
            target=tuple(CUBE_CENTRE.tolist()),
            field_of_view=1.2 * self.field_of_view,
            image_size=self.image_size,
        )

    @cached_property
    def intrinsics(self) -> FloatArray:
        """Its camera matrix, shape [3, 3], pixels."""
        return Camera(field_of_view=self.field_of_view, image_size=self.image_size).intrinsics

    def bent(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the ideal camera's image as the lens shows it."""
        return np.asarray(cv2.remap(image, *self._maps, cv2.INTER_LINEAR), dtype=np.uint8)

    @cached_property
    def _maps(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Where in the ideal camera's image each pixel looks."""
        width, height = self.image_size
        x, y = np.meshgrid(np.arange(width, dtype=np.float64), np.arange(height, dtype=np.float64))
        pixels = np.stack([x.ravel(), y.ravel()], axis=1)[:, np.newaxis]
        rays = cv2.undistortPoints(pixels, self.intrinsics, np.array(self.distortion)).reshape(-1, 2)
        ideal = self.camera.intrinsics
        columns = rays[:, 0] * ideal[0, 0] + ideal[0, 2]
        rows = rays[:, 1] * ideal[1, 1] + ideal[1, 2]
        return (
            columns.reshape(height, width).astype(np.float32),
            rows.reshape(height, width).astype(np.float32),
        )


class TurningFilm:
    """A film of cubes that are put down one after the other, turned, and taken away.

    Args:
        cubes: Of each cube the pictures on its faces, RGB, in the order of ``atg_fg.worlds.arcube.FACES``.
        webcam: What the camera does to the picture.
        seed: Of noise, and of how straight the cube is put down.
        askew: How far it may be turned off straight, degrees.
        rest: Seconds that a cube stands between two turns.
        turn: Seconds that a turn takes.
        hands: Whether a hand is in the picture while a cube is turned.

    Attributes:
        webcam: What the camera does to the picture.
    """

    def __init__(
        self,
        cubes: Sequence[Sequence[NDArray[np.uint8]]],
        webcam: Webcam | None = None,
        seed: int = 0,
        *,
        askew: float = 8.0,
        rest: float = 0.9,
        turn: float = 0.9,
        hands: bool = True,
    ) -> None:
        self.webcam = webcam or Webcam()
        self._rng = np.random.default_rng(seed)
        self._askew, self._rest, self._turn, self._hands = askew, rest, turn, hands
        self._client = pybullet.connect(pybullet.DIRECT)
        self._disconnect = weakref.finalize(self, pybullet.disconnect, physicsClientId=self._client)
        self._build_table()
        self._cubes = [CubeBody(self._client, faces=faces) for faces in cubes]
        for body in self._cubes:
            body.show((0, 1, 2, 3, 4, 5))
        self._hand = [self._ball(radius) for radius in (0.05, 0.035, 0.035, 0.035, 0.07)]
        self._time = 0.0
        self._clear()

    def close(self) -> None:
        """Leave PyBullet."""
        self._disconnect()

    def frames(self, cube: int, actions: Sequence[str], start: FloatArray | None = None) -> Iterator[NDArray[np.uint8]]:
        """Film one cube: put down, turned by the actions, and taken away for a while.

        Args:
            cube: Which one.
            actions: Names of the actions.
            start: How it stands first, a rotation matrix; upright if not given.
        """
        stands = np.eye(3) if start is None else start
        place, skew = self._put_down()
        yield from self._still(cube, place, skew @ stands, self._rest)
        for action in actions:
            before, before_skew = place, skew
            place, skew = self._put_down()
            yield from self._turned(cube, action, (before, before_skew @ stands), place)
            stands = ACTION_ROTATIONS[action] @ stands
            yield from self._still(cube, place, skew @ stands, self._rest)
        self._clear()
        empty = self._shot()
        for _ in range(round(2.5 * self.webcam.rate)):
            yield self._finished(empty)

    def _put_down(self) -> tuple[FloatArray, FloatArray]:
        """Return where the cube comes to stand, and how far off straight."""
        offset = np.append(self._rng.uniform(-0.02, 0.02, 2), 0.0)
        return CUBE_CENTRE + offset, _about([0, 0, 1], self._rng.uniform(-1, 1) * self._askew)

    def _still(self, cube: int, place: FloatArray, rotation: FloatArray, seconds: float) -> Iterator[NDArray[np.uint8]]:
        self._cubes[cube].place(place, rotation)
        self._hide_hand()
        shot = self._shot()
        for number in range(round(seconds * self.webcam.rate)):
            if number % _FRAMES_A_SHOT == _FRAMES_A_SHOT - 1:
                shot = self._shot()
            yield self._finished(shot)

    def _turned(
        self, cube: int, action: str, begin: tuple[FloatArray, FloatArray], goal: FloatArray
    ) -> Iterator[NDArray[np.uint8]]:
        """Lift the cube, turn it in the hand, and put it down."""
        place, rotation = begin
        quarter = cv2.Rodrigues(ACTION_ROTATIONS[action])[0].ravel()
        n_frames = round(self._turn * self.webcam.rate)
        for number in range(n_frames):
            shots = []
            for share in (0.0, 0.5 * self.webcam.exposure, self.webcam.exposure):
                done = (number + share) / n_frames
                eased = done * done * (3 - 2 * done)
                turned = cv2.Rodrigues(eased * quarter)[0] @ rotation
                lift = np.array([0.0, 0.0, 0.8 * CUBE_SIZE * np.sin(np.pi * done)])
                where = (1 - eased) * place + eased * goal + lift
                self._cubes[cube].place(where, turned)
                self._hold(where)
                shots.append(self._shot())
            yield self._finished(np.mean(shots, axis=0).astype(np.uint8))

    def _hold(self, cube: FloatArray) -> None:
        """Put the hand at the cube's right side, a finger over the front."""
        if not self._hands:
            return
        half = CUBE_SIZE / 2
        places = [(0, -1.15, 0), (-1.05, -0.85, 0.2), (-1.05, -0.7, -0.15), (-1.0, -0.9, -0.5), (0.1, -1.7, -0.1)]
        for ball, offset in zip(self._hand, places, strict=True):
            self._move(ball, cube + half * np.array(offset))

    def _hide_hand(self) -> None:
        for ball in self._hand:
            self._move(ball, _AWAY)

    def _clear(self) -> None:
        """Take all away but the table."""
        self._hide_hand()
        for body in self._cubes:
            body.place(_AWAY, np.eye(3))

    def _shot(self) -> NDArray[np.uint8]:
        angle = 2 * np.pi * self._time / self.webcam.light_period
        lamp = Light((-0.6 + 0.5 * float(np.cos(angle)), 0.6 * float(np.sin(angle)), 1.4), 0.6, 0.4)
        return self.webcam.camera.render(self._client, lamp)

    def _finished(self, image: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return an image as the webcam gives it, and let its time pass."""
        self._time += 1 / self.webcam.rate
        bent = self.webcam.bent(image)
        noisy = bent + self._rng.normal(0.0, self.webcam.noise, bent.shape)
        return np.clip(np.round(noisy), 0, 255).astype(np.uint8)

    def _build_table(self) -> None:
        top = CUBE_CENTRE[2] - CUBE_SIZE / 2
        for half, colour, height in (
            ([1.2, 1.2, 0.02], [0.62, 0.47, 0.33, 1.0], top - 0.02),
            ([6.0, 6.0, 0.01], [0.7, 0.72, 0.74, 1.0], -0.5),
        ):
            shape = pybullet.createVisualShape(
                pybullet.GEOM_BOX, halfExtents=half, rgbaColor=colour, physicsClientId=self._client
            )
            pybullet.createMultiBody(0, -1, shape, [0.8, 0.0, height], physicsClientId=self._client)

    def _ball(self, radius: float) -> int:
        shape = pybullet.createVisualShape(
            pybullet.GEOM_SPHERE, radius=radius, rgbaColor=_SKIN, physicsClientId=self._client
        )
        return int(pybullet.createMultiBody(0, -1, shape, _AWAY.tolist(), physicsClientId=self._client))

    def _move(self, body: int, place: FloatArray) -> None:
        pybullet.resetBasePositionAndOrientation(body, place.tolist(), [0, 0, 0, 1], physicsClientId=self._client)


def write_video(path: Path, frames: Iterator[NDArray[np.uint8]], rate: float) -> int:
    """Write RGB frames as a video, whole or not at all, and return how many there were.

    Raises:
        InvalidInputError: Another suffix than those of ``CODECS``, or no place that can be written.
    """
    if path.suffix.lower() not in CODECS:
        raise InvalidInputError(f"{path}: suffix {path.suffix!r}; expected one of: {', '.join(CODECS)}")
    n_frames = 0
    # OpenCV opens what it writes to by itself, and would wait for who reads from a pipe.
    with tempfile.TemporaryDirectory(prefix="atg-fg-") as folder:
        film = Path(folder) / f"film{path.suffix.lower()}"
        writer: cv2.VideoWriter | None = None
        for frame in frames:
            if writer is None:
                code = cv2.VideoWriter.fourcc(*CODECS[path.suffix.lower()])
                writer = cv2.VideoWriter(str(film), code, rate, (frame.shape[1], frame.shape[0]))
                if not writer.isOpened():
                    raise InvalidInputError(f"{path}: OpenCV cannot write such a video here; expected another suffix")
            n_frames += 1
            writer.write(np.asarray(cv2.cvtColor(frame, cv2.COLOR_RGB2BGR)))
        if writer is not None:
            writer.release()
            write_bytes_atomically(path, film.read_bytes())
    return n_frames


def _about(axis: Sequence[float], degrees: float) -> FloatArray:
    return np.asarray(cv2.Rodrigues(np.radians(degrees) * np.array(axis, dtype=np.float64))[0])
