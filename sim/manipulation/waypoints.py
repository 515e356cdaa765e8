"""The three actions as way-points of both hands about the cube: approach, grasp, lift, turn, put down, release.

A plan is geometry only: it is made from where the cube is seen to stand, and knows nothing of joints or forces.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from atg_fg.core.patterns import FloatArray
from sim.bodies.cube import CUBE_CENTRE, CUBE_SIZE
from sim.manipulation.inverse_kinematics import HandTask
from sim.vision.cube_pose import CubePose

#: Inward normals of the faces that the left and the right hand press, in the cube's frame, shape [2, 3].
INWARD: Final[FloatArray] = np.array([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
#: How hard each hand presses, N.
GRIP_FORCE: Final = 60.0
_WIDE, _NEAR, _TRANSIT = 0.10, 0.02, 0.085  # m from the faces
_PRESS: Final = -0.002  # m into the faces, so that the hands do not lose touch
_FLIP_LIFT, _TURN_LIFT, _SLIDE_LIFT = 0.09, 0.006, 0.004  # m
_PUT_DOWN: Final = np.array([0.0, 0.0, -0.003])  # a little below the table, so that the cube is felt to stand
#: The first half of a yaw ends nearer to the robot, where the second half's hands reach both corners.
HALFWAY: Final = np.array([-0.05, 0.0, 0.0])
#: How far a hand leans from the face's normal at most: a yaw takes it to the limits of the wrist.
_FLIP_CONE, _YAW_CONE = 0.6, 1.25  # rad


@dataclass(frozen=True, eq=False)
class Waypoint:
    """Both hands about the cube, one on either side.

    Attributes:
        name: Of the phase of the plan.
        position: Where the cube's centre is or shall be, shape [3], m.
        rotation: How the cube is turned, of which the hands touch the left and right faces, shape [3, 3].
        clearance: Between pads and faces, m; negative presses.
        seconds: Time to get there.
        flips: Whether the palms turn with the cube.
        grip: How hard each hand presses, N.
        still: Time to wait there, s.
    """

    name: str
    position: FloatArray
    rotation: FloatArray
    clearance: float
    seconds: float
    flips: bool = True
    grip: float = 0.0
    still: float = 0.0

    def task(self, rolled: FloatArray, pad_radius: FloatArray) -> HandTask:
        """Return what the hands have to do.

        Args:
            rolled: How far the pads have rolled over the faces, in the cube's frame, shape [2, 3], m.
            pad_radius: Of both pads, shape [2], m.
        """
        normal = INWARD @ self.rotation.T
        reach = (CUBE_SIZE / 2 + self.clearance + pad_radius)[:, None]
        palm = np.tile(self.rotation @ [0.0, 0.0, -1.0], (2, 1)) if self.flips else None
        pad = self.position - reach * normal + rolled @ self.rotation.T
        return HandTask(pad, normal, _FLIP_CONE if self.flips else _YAW_CONE, palm)


def about_vertical(angle: float) -> FloatArray:
    """Return the rotation about the vertical by ``angle`` (rad), shape [3, 3]."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def towards_robot(angle: float) -> FloatArray:
    """Return the rotation about −y by ``angle`` (rad), which brings the top towards the robot, shape [3, 3]."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, 0.0, -sine], [0.0, 1.0, 0.0], [sine, 0.0, cosine]])


def flip(cube: CubePose) -> Iterator[Waypoint]:
    """Bring the top to the front: lift the cube, turn it by 90° about the line between the hands, put it down."""
    yield from _grasp(cube.position, cube.yaw)
    lift = np.array([0.0, 0.0, _FLIP_LIFT])
    for part in _parts(6):
        position = cube.position + part * (CUBE_CENTRE - cube.position + lift)
        yield Waypoint("lift", position, about_vertical(cube.yaw * (1 - part)), _PRESS, 0.12, grip=GRIP_FORCE)
    for part in _parts(12):
        still = 0.125 if part == 1 else 0.0
        yield Waypoint(
            "turn", CUBE_CENTRE + lift, towards_robot(part * np.pi / 2), _PRESS, 0.12, grip=GRIP_FORCE, still=still
        )
    turned = towards_robot(np.pi / 2)
    for part in _parts(6):
        position = CUBE_CENTRE + (1 - part) * lift + part * _PUT_DOWN
        yield Waypoint("put down", position, turned, _PRESS, 0.12, grip=GRIP_FORCE, still=0.1 if part == 1 else 0.0)
    yield from _release(CUBE_CENTRE, turned)
    for part in _parts(6):
        yield Waypoint("unwind", CUBE_CENTRE, towards_robot((1 - part) * np.pi / 2), _WIDE, 0.1)


def turn_to_halfway(cube: CubePose, direction: int) -> Iterator[Waypoint]:
    """Turn the cube by 45° about the vertical, to the left (1: the left face comes to the front) or right (−1)."""
    yield from _grasp(cube.position, cube.yaw, flips=False)
    yield from _drag(cube.position, cube.yaw, CUBE_CENTRE + HALFWAY, direction * np.pi / 4)


def turn_from_halfway(cube: CubePose, direction: int) -> Iterator[Waypoint]:
    """Take the other two faces of a cube that stands at 45°, and turn it by 45° more."""
    begin = direction * np.pi / 4
    # The same yaw, as a quarter turn about the vertical has it: the faces to the other side of straight ahead.
    grasp = min((cube.yaw + turn * np.pi / 2 for turn in (-1, 0, 1)), key=lambda yaw: abs(yaw + begin))
    for part in _parts(9):
        rotation = about_vertical(begin + part * (grasp - begin))
        yield Waypoint("change hands", cube.position, rotation, _TRANSIT, 0.12, flips=False)
    yield from _grasp(cube.position, grasp, flips=False)
    yield from _drag(cube.position, grasp, CUBE_CENTRE, 0.0)


def square(cube: CubePose) -> Iterator[Waypoint]:
    """Slide the cube to where it should stand."""
    yield from _grasp(cube.position, cube.yaw)
    lift = np.array([0.0, 0.0, _SLIDE_LIFT])
    for part in _parts(5):
        position = cube.position + part * (CUBE_CENTRE - cube.position) + lift
        yield Waypoint("slide", position, about_vertical(cube.yaw * (1 - part)), _PRESS, 0.12, grip=GRIP_FORCE)
    yield Waypoint("put down", CUBE_CENTRE + _PUT_DOWN, np.eye(3), _PRESS, 0.12, grip=GRIP_FORCE, still=0.1)
    yield from _release(CUBE_CENTRE, np.eye(3))


def _grasp(position: FloatArray, yaw: float, *, flips: bool = True) -> Iterator[Waypoint]:
    rotation = about_vertical(yaw)
    yield Waypoint("approach", position, rotation, _WIDE if flips else _TRANSIT, 0.4, flips)
    yield Waypoint("approach", position, rotation, _NEAR, 0.3, flips)
    # Touch first, then press: a hand pushed before it touches is pushed aside as well.
    yield Waypoint("grasp", position, rotation, _PRESS, 0.5, flips, still=0.05)
    yield Waypoint("grasp", position, rotation, _PRESS, 0.15, flips, GRIP_FORCE, still=0.05)


def _drag(start: FloatArray, start_yaw: float, end: FloatArray, end_yaw: float) -> Iterator[Waypoint]:
    """Turn the cube about the vertical, hardly lifted, put it down and let it go."""
    lift = np.array([0.0, 0.0, _TURN_LIFT])
    yield Waypoint("lift", start + lift, about_vertical(start_yaw), _PRESS, 0.12, False, GRIP_FORCE)
    for part in _parts(8):
        rotation = about_vertical(start_yaw + part * (end_yaw - start_yaw))
        yield Waypoint("turn", start + part * (end - start) + lift, rotation, _PRESS, 0.12, False, GRIP_FORCE)
    rotation = about_vertical(end_yaw)
    yield Waypoint("put down", end + _PUT_DOWN, rotation, _PRESS, 0.15, False, GRIP_FORCE, 0.1)
    yield from _release(end, rotation, flips=False)


def _release(position: FloatArray, rotation: FloatArray, *, flips: bool = True) -> Iterator[Waypoint]:
    yield Waypoint("release", position, rotation, _PRESS, 0.15, flips, still=0.05)
    yield Waypoint("release", position, rotation, _NEAR, 0.25, flips)
    yield Waypoint("release", position, rotation, _WIDE if flips else _TRANSIT, 0.3, flips)


def _parts(n: int) -> FloatArray:
    """Return 1/n, 2/n, … 1."""
    return np.arange(1, n + 1) / n
