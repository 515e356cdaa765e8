"""The actions carried out: way-points to joint targets, the camera's estimate in, motions out."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import groupby
from typing import Final

import numpy as np

from atg_fg.core.errors import AtgError
from atg_fg.core.patterns import FloatArray
from sim.bodies.cube import CUBE_CENTRE
from sim.bodies.kinematics import cross
from sim.bodies.robot import RobotBody
from sim.manipulation import waypoints
from sim.manipulation.impedance_control import TIME_STEP, ArmController, JointTarget
from sim.manipulation.inverse_kinematics import Solution, solve
from sim.manipulation.waypoints import INWARD, Waypoint
from sim.vision.cube_pose import CubePose

_MOST_SQUARINGS: Final = 2
#: A hand that would miss its place on a face by more cannot hold the cube, m.
_FARTHEST_MISS: Final = 0.03
_ROLLING_ITERATIONS: Final = 3
_ROLLED_ENOUGH: Final = 2e-4  # m


class OutOfReachError(AtgError):
    """A cube that stands where the hands cannot hold it."""


class Manipulator:
    """Carries out flip, left and right on a cube that it sees.

    Args:
        controller: Of the arms.
        look: Returns where the cube is seen to stand; the only thing known about it.
        on_phase: Called with the name of each phase of a plan as it begins.

    Attributes:
        squarings: How often the cube had to be squared up.
        phase: Name of the phase that a plan is in, or was in last.
    """

    def __init__(
        self,
        controller: ArmController,
        look: Callable[[], CubePose],
        on_phase: Callable[[str], None] | None = None,
    ) -> None:
        self.controller = controller
        self.robot: RobotBody = controller.robot
        self.kinematics = self.robot.kinematics
        self.home, self.tucked = self.robot.model.home, self.robot.model.tucked
        self.look = look
        self.on_phase = on_phase
        self.squarings = 0
        self.phase = ""
        self._rolled = self._rolling = np.zeros((2, 3))
        self._held: FloatArray | None = None

    def act(self, action: str) -> None:
        """Do one of ``flip``, ``left``, ``right``, then square the cube up if it needs it.

        Raises:
            OutOfReachError: The cube is seen where the hands cannot hold it.
        """
        if action == "flip":
            self._follow(waypoints.flip(self.look()))
        else:
            direction = 1 if action == "left" else -1
            self._follow(waypoints.turn_to_halfway(self.look(), direction))
            self._follow(waypoints.turn_from_halfway(self.look(), direction))
        self.go_home()
        for _ in range(_MOST_SQUARINGS):
            cube = self.look()
            if cube.is_square:
                break
            self.squarings += 1
            self._follow(waypoints.square(cube))
            self.go_home()

    def _follow(self, waypoints: Iterable[Waypoint]) -> None:
        """Go through way-points, one phase after the other."""
        for phase, group in groupby(waypoints, key=lambda waypoint: waypoint.name):
            self.phase = phase
            if self.on_phase is not None:
                self.on_phase(phase)
            targets: list[JointTarget] = []
            angles = self.controller.reference
            for waypoint in group:
                targets.append(self._target(waypoint, angles))
                angles = targets[-1].angles
            self.controller.run(targets)

    def _target(self, waypoint: Waypoint, start: FloatArray) -> JointTarget:
        solution = self._solve(waypoint, start)
        if waypoint.grip and solution.position_error.max() > _FARTHEST_MISS:
            x, y, _ = waypoint.position
            raise OutOfReachError(
                f"{waypoint.name}: the cube at x {x:.3f}, y {y:.3f} m is out of reach of a hand by "
                f"{solution.position_error.max():.3f} m; expected it near x {CUBE_CENTRE[0]}, y {CUBE_CENTRE[1]} m"
            )
        force = waypoint.grip * INWARD @ waypoint.rotation.T
        grip = (solution.hands.jacobian[:, :3].transpose(0, 2, 1) @ force[..., None])[..., 0]
        gravity = self.robot.gravity_torques(solution.angles)
        return JointTarget(solution.angles, gravity + grip, waypoint.seconds, waypoint.still)

    def _solve(self, waypoint: Waypoint, start: FloatArray) -> Solution:
        """Solve for joint angles, and keep account of how the pads roll over the faces while they hold the cube."""
        if waypoint.name == "approach":
            self._rolled, self._rolling, self._held = np.zeros((2, 3)), np.zeros((2, 3)), None
        if not waypoint.grip:
            return self._reached(waypoint, start)
        rolled = self._rolled
        # Most likely they go on as before.
        self._rolled = rolled + self._rolling
        solution = self._reached(waypoint, start)
        for _ in range(_ROLLING_ITERATIONS):
            if self._held is None:
                break
            before, hands = self._rolled, waypoint.rotation.T @ solution.hands.rotation
            self._rolled = rolled + _rolling(self._held, hands, self.kinematics.pad_radius)
            if np.abs(self._rolled - before).max() < _ROLLED_ENOUGH:
                break
            solution = self._reached(waypoint, solution.angles)
        self._rolling = self._rolled - rolled
        self._held = waypoint.rotation.T @ solution.hands.rotation
        return solution

    def _reached(self, waypoint: Waypoint, start: FloatArray) -> Solution:
        task = waypoint.task(self._rolled, self.kinematics.pad_radius)
        return solve(self.kinematics, task, start, self.home)

    def go_home(self) -> None:
        """Take the hands back to the cube's sides, clear of it."""
        self._take_arms_to(self.home)

    def slide(self, place: float) -> None:
        """Raise the arms, slide to ``place`` (m to the left of the rail's middle), and take the hands home there."""
        if self.robot.rail is None:
            return
        self._take_arms_to(self.tucked)
        for _ in self.robot.rail.ride(place):
            self.controller.hold(TIME_STEP)
        self.go_home()

    def _take_arms_to(self, posture: FloatArray) -> None:
        self.controller.run([JointTarget(posture, self.robot.gravity_torques(posture), 0.3, still=0.1)])


def _rolling(before: FloatArray, after: FloatArray, radius: FloatArray) -> FloatArray:
    """Return how far pads roll over the faces as hands turn in the cube's frame, shapes [2, 3, 3] to [2, 3], m."""
    turn = after @ before.transpose(0, 2, 1)
    # For small turns, the rotation vector is the antisymmetric part.
    vector = np.stack([turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]], 1)
    return radius[:, None] * cross(vector / 2, -INWARD)
