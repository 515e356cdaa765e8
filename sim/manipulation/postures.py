"""Home and tucked postures for the robot at hand: of many solutions of inverse kinematics, those that work best.

A home posture has the hands beside the cube, such that all three actions can be done from it: every way-point within
reach, and no arm in the way of another, the trunk, the head or the table. Many are tried at once, as arms side by side.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
import pybullet

from atg_fg.core.patterns import FloatArray
from sim.bodies.cube import CUBE_CENTRE
from sim.bodies.kinematics import ArmKinematics
from sim.bodies.robot import RobotBody
from sim.manipulation import waypoints
from sim.manipulation.inverse_kinematics import HandTask, Solution, solve
from sim.manipulation.waypoints import HALFWAY, INWARD, Waypoint
from sim.vision.cube_pose import CubePose

_N_STARTS: Final = 96
_N_TRIED: Final = 24
_SOLVING_ROUNDS: Final = 3
#: Where raised hands are, from the middle between the shoulders: before the left one, m; the right one's is mirrored.
_TUCKED: Final = np.array([0.28, 0.20, 0.12])
#: What a miss by a tolerance counts for, against a second of motion, and against a posture in which something touches.
_MISS_COST, _SECOND_COST, _TOUCH_COST = 1.0, 0.02, 20.0
_POSITION_TOLERANCE, _ANGLE_TOLERANCE = 0.006, 0.1  # m, rad
#: Links that overlap in at least this share of random postures do so at rest.
_ALWAYS: Final = 0.95


class PostureSearch:
    """Finds the postures of one robot; its body in a client of its own, with a table before it and no cube.

    Args:
        robot: The body; its arms are moved about.
        kinematics: Of its arms, with the pads.
        tables: Bodies that the arms must not touch.
        seed: Of the postures that are tried.
    """

    def __init__(self, robot: RobotBody, kinematics: ArmKinematics, tables: Sequence[int], seed: int = 0) -> None:
        self._robot, self._kinematics, self._tables = robot, kinematics, tables
        self._rng = np.random.default_rng(seed)

    def overlapping(self) -> list[tuple[str, str]]:
        """Return the pairs of links, by the names of their joints, that overlap whatever the arms do."""
        counts: dict[tuple[int, int], int] = {}
        for angles in self._starts(_N_STARTS).reshape(_N_STARTS, 2, -1):
            for pair in {(min(pair), max(pair)) for pair in self._touching(angles, [self._robot.body])}:
                counts[pair] = counts.get(pair, 0) + 1
        names = {index: name for name, index in self._robot.links.items()}
        always = (pair for pair, count in counts.items() if count >= _ALWAYS * _N_STARTS)
        return sorted((names[one], names[other]) for one, other in always)

    def home(self) -> FloatArray:
        """Return joint angles beside the cube from which all three actions come out best, shape [2, joints], rad."""
        begin = next(waypoints.flip(_AT_ITS_PLACE))
        starts, misses = self._solved(begin, self._starts(_N_STARTS))
        tried = _best_of_each_arm(starts, misses, _N_TRIED)
        costs = np.zeros((_N_TRIED, 2))
        for action in _all_actions():
            costs = costs + self._costs(action, tried)
        return _chosen(tried, costs + _TOUCH_COST * self._touches(tried[None]))

    def tucked(self, home: FloatArray) -> FloatArray:
        """Return joint angles with the hands raised before the shoulders, near to ``home``, shape [2, joints], rad."""
        shoulders = self._kinematics.positions[:, 0].mean(axis=0)
        pads = shoulders + _TUCKED * np.array([[1, 1, 1], [1, -1, 1]])
        task = HandTask(pads, INWARD, np.pi)
        starts = np.concatenate([np.tile(home, (_N_TRIED, 1)), self._starts(_N_STARTS)])
        many = self._kinematics.repeated(len(starts) // 2)
        solution = solve(many, _tiled(task, len(starts) // 2), starts, starts)
        tried = _best_of_each_arm(solution.angles, _misses(solution), _N_TRIED)
        ways = np.linspace(home, tried.reshape(_N_TRIED, 2, -1), 6).reshape(6, 2 * _N_TRIED, -1)
        travel = np.abs(ways[-1] - ways[0]).max(axis=1).reshape(_N_TRIED, 2)
        misses = _misses(solve(self._kinematics.repeated(_N_TRIED), _tiled(task, _N_TRIED), tried, tried))
        costs = misses.reshape(_N_TRIED, 2) + travel + _TOUCH_COST * self._touches(ways)
        return _chosen(tried, costs)

    def _starts(self, number: int) -> FloatArray:
        """Return random joint angles of ``number`` robots, shape [2 number, joints]."""
        kinematics = self._kinematics.repeated(number)
        return self._rng.uniform(kinematics.lower, kinematics.upper)

    def _solved(self, waypoint: Waypoint, starts: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return joint angles at a way-point, and how far they miss it in tolerances, shape [2 n]."""
        number = len(starts) // 2
        many, task = self._kinematics.repeated(number), _task(waypoint, self._kinematics, number)
        for _ in range(_SOLVING_ROUNDS):
            solution = solve(many, task, starts, starts)
            starts = solution.angles
        return starts, _misses(solution)

    def _costs(self, action: Sequence[Waypoint], homes: FloatArray) -> FloatArray:
        """Return what an action from each of some homes costs each arm, shape [n, 2]."""
        number = len(homes) // 2
        many = self._kinematics.repeated(number)
        angles, worst, seconds, path = homes, np.zeros(len(homes)), np.zeros(len(homes)), []
        speeds = np.tile(self._robot.velocity, (number, 1))
        for waypoint in action:
            solution = solve(many, _task(waypoint, self._kinematics, number), angles, homes)
            worst = np.maximum(worst, _misses(solution))
            seconds += (np.abs(solution.angles - angles) / speeds).max(axis=1)
            angles = solution.angles
            path.append(angles)
        costs = _MISS_COST * worst + _SECOND_COST * seconds
        return costs.reshape(number, 2) + _TOUCH_COST * self._touches(np.array(path[::2]))

    def _touches(self, paths: FloatArray) -> FloatArray:
        """Return in which share of the postures of a path each arm touches something, shape [n, 2].

        Args:
            paths: Of n robots, shape [postures, 2 n, joints], rad.
        """
        n_postures, n_arms, _ = paths.shape
        counts = np.zeros((n_arms // 2, 2))
        hand_of = {link: side for side, links in enumerate(self._arm_links()) for link in links}
        for posture in paths.reshape(n_postures, n_arms // 2, 2, -1):
            for number, angles in enumerate(posture):
                touching = self._touching(angles, [self._robot.body, *self._tables])
                for side in {hand_of[link] for pair in touching for link in pair if link in hand_of}:
                    counts[number, side] += 1
        return np.asarray(counts / n_postures)

    def _arm_links(self) -> list[list[int]]:
        return [[self._robot.joints[name] for name in arm] for arm in self._robot.model.arm_joints]

    def _touching(self, angles: FloatArray, bodies: Sequence[int]) -> list[tuple[int, int]]:
        """Return pairs of links that touch with the arms in a posture; the second is −2 for another body's."""
        client = self._robot.client
        self._robot.reset(angles)
        pybullet.performCollisionDetection(physicsClientId=client)
        return [
            (point[3], point[4] if body == self._robot.body else -2)
            for body in bodies
            for point in pybullet.getContactPoints(self._robot.body, body, physicsClientId=client)
            if point[8] < 0
        ]


_AT_ITS_PLACE: Final = CubePose(CUBE_CENTRE, 0.0)


def _all_actions() -> Iterator[list[Waypoint]]:
    """Yield the way-points of all actions on a cube that goes where it should."""
    yield list(waypoints.flip(_AT_ITS_PLACE))
    for direction in (1, -1):
        halfway = CubePose(CUBE_CENTRE + HALFWAY, direction * np.pi / 4)
        yield [*waypoints.turn_to_halfway(_AT_ITS_PLACE, direction), *waypoints.turn_from_halfway(halfway, direction)]


def _tiled(task: HandTask, number: int) -> HandTask:
    palm = None if task.palm is None else np.tile(task.palm, (number, 1))
    return HandTask(np.tile(task.pad, (number, 1)), np.tile(task.normal, (number, 1)), task.cone, palm)


def _task(waypoint: Waypoint, kinematics: ArmKinematics, number: int) -> HandTask:
    return _tiled(waypoint.task(np.zeros((2, 3)), kinematics.pad_radius), number)


def _misses(solution: Solution) -> FloatArray:
    """Return how far each arm misses its task, in tolerances."""
    turned = np.maximum(solution.cone_error, solution.palm_error)
    return np.maximum(solution.position_error / _POSITION_TOLERANCE, turned / _ANGLE_TOLERANCE)


def _best_of_each_arm(angles: FloatArray, misses: FloatArray, number: int) -> FloatArray:
    """Return ``number`` robots made of the arms that miss least, shape [2 number, joints]."""
    by_arm, misses = angles.reshape(-1, 2, angles.shape[1]), misses.reshape(-1, 2)
    order = np.argsort(misses > 1, axis=0, kind="stable")[:number]
    return np.take_along_axis(by_arm, order[..., None], axis=0).reshape(2 * number, -1)


def _chosen(angles: FloatArray, costs: FloatArray) -> FloatArray:
    """Return the cheaper of each arm, from angles of shape [2 n, joints] and costs of shape [n, 2]."""
    by_arm = angles.reshape(-1, 2, angles.shape[1])
    best = costs.argmin(axis=0)
    return np.stack([by_arm[best[side], side] for side in range(2)])
