"""The scene in PyBullet: floor, tables, cubes and robot; its clock, its circumstances, and snapshots of its state."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

import numpy as np
import pybullet
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray
from atg_fg.worlds.arcube import Cube
from sim.bodies.cube import CUBE_CENTRE, CUBE_SIZE, CubeBody
from sim.bodies.prepared_robot import PreparedRobot
from sim.bodies.robot import RobotBody
from sim.bodies.tables import TABLE_MIDDLE, TABLE_SIZE, TABLE_TOP, slab, table_top
from sim.manipulation.impedance_control import TIME_STEP
from sim.worlds.domain_randomization import Circumstances

#: From one table's middle to the next one's, m: the arms at work reach into no neighbour's place.
STATION_SPACING: Final = 0.85
_RAIL_SPARE: Final = 0.05  # m beyond the last stations
_RAILS: Final = (-0.20, 0.12)  # m, under the robot's base
_SOLVER_ITERATIONS: Final = 20
#: Contacts are looked at every so many steps.
_STEPS_PER_SAMPLE: Final = 8
_GRAVITY: Final = 9.81  # m/s²
_FLOOR_SIZE: Final = [4.0, 4.0, 0.01]  # half extents, m
_FLOOR_HEIGHT, _OUT_OF_SIGHT = -0.51, [0.0, 0.0, 50.0]  # m
_STEEL, _FLOOR = (0.45, 0.46, 0.48, 1.0), (0.80, 0.82, 0.84, 1.0)


@dataclass(frozen=True, eq=False)
class PlacedCube:
    """A cube as it stands at its station when a trial begins.

    Attributes:
        symbols: Of its faces.
        position: Of its centre in the station's frame, shape [3], m.
        rotation: Shape [3, 3].
    """

    symbols: Cube
    position: FloatArray
    rotation: FloatArray


class Scene:
    """A PyBullet client with the robot and one cube or more, each on a table of its own.

    Where there are several, the tables stand in a row from the robot's left to its right, and the robot slides on a
    rail from station to station. A station's frame is the robot's when it stands there.

    What PyBullet keeps of a scene is not quite all: after another trial, one that is set back to its beginning would
    not go the same way to the last bit. So every trial has a scene of its own.

    Args:
        circumstances: Masses, frictions, and how the floor leans.
        cubes: One a station; the robot begins at the first.
        robot: The robot, instead of the shell.
        pictures: What each symbol looks like, RGB, if it is not a tag.

    Attributes:
        cubes: One a station.
        tables: The table tops, one a station.
        station: Where the robot works; who slides it says so.
        steps: Steps of the simulation since the beginning.
        peak_force: Greatest normal force of either hand on the cube at this station since it was last set to zero, N.
        self_contacts: Samples in which an arm touched the torso, the head or the other arm.
        on_step: Called after each step.
    """

    def __init__(
        self,
        circumstances: Circumstances,
        cubes: Sequence[PlacedCube],
        robot: PreparedRobot | None = None,
        pictures: Sequence[NDArray[np.uint8]] | None = None,
    ) -> None:
        self.client: int = pybullet.connect(pybullet.DIRECT)
        # A scene that nobody closes must not keep its client until the process ends.
        self._disconnect = weakref.finalize(self, pybullet.disconnect, physicsClientId=self.client)
        pybullet.setTimeStep(TIME_STEP, physicsClientId=self.client)
        pybullet.setPhysicsEngineParameter(
            numSolverIterations=_SOLVER_ITERATIONS,
            solverResidualThreshold=0,
            deterministicOverlappingPairs=1,
            physicsClientId=self.client,
        )
        self.steps = self.self_contacts = self.station = 0
        self.peak_force = 0.0
        self.on_step: Callable[[], None] | None = None
        middle = (len(cubes) - 1) / 2
        self._origins = [np.array([0.0, STATION_SPACING * (middle - station), 0.0]) for station in range(len(cubes))]
        # What is touched of the floor is not seen. What is seen of it and of the tables' feet, dear to draw, is out of
        # the head's sight but when an observer looks.
        self._scenery: list[tuple[int, list[float]]] = []
        self._put_up(_FLOOR_SIZE, [0.0, 0.0, _FLOOR_HEIGHT], _FLOOR)
        self.cubes: list[CubeBody] = []
        for _ in cubes:
            like = self.cubes[0] if self.cubes else None
            self.cubes.append(CubeBody(self.client, circumstances.cube_mass, like, pictures))
        # What a cube hides of its table is not drawn if the cube is drawn first.
        self.tables = [self._build_table(origin) for origin in self._origins]
        self.robot = RobotBody(self.client, robot, STATION_SPACING * middle + _RAIL_SPARE if len(cubes) > 1 else None)
        if self.robot.rail is not None:
            self._draw_rails(STATION_SPACING * middle)
            self.robot.rail.reset(self.rail_position(0))
        self._apply(circumstances)
        for body, cube, origin in zip(self.cubes, cubes, self._origins, strict=True):
            body.show(cube.symbols)
            body.place(cube.position + origin, cube.rotation)

    def advance(self) -> None:
        """Take the simulation one step on."""
        pybullet.stepSimulation(physicsClientId=self.client)
        self.steps += 1
        if self.steps % _STEPS_PER_SAMPLE == 0:
            self.peak_force = max(self.peak_force, *self.robot.contact_forces(self.cube.body))
            self.self_contacts += self.robot.touches_itself()
        if self.on_step is not None:
            self.on_step()

    @property
    def seconds(self) -> float:
        """Simulated time since the beginning, s."""
        return self.steps * TIME_STEP

    @property
    def cube(self) -> CubeBody:
        """The cube of the station where the robot works."""
        return self.cubes[self.station]

    def rail_position(self, station: int) -> float:
        """Return where the robot stands on its rail at a station, m to the left of its middle."""
        return float(self._origins[station][1])

    def cube_pose(self, station: int | None = None) -> tuple[FloatArray, FloatArray]:
        """Return the true position of a station's cube in the station's frame, shape [3], m, and its rotation, [3, 3].

        Without a number, it is the station where the robot works.
        """
        station = self.station if station is None else station
        position, rotation = self.cubes[station].pose()
        return position - self._origins[station], rotation

    def has_lost_the_cube(self, station: int | None = None) -> bool:
        """Whether a station's cube is off its table, or too far for the hands; by the simulator's truth."""
        (x, y, z), _ = self.cube_pose(station)
        on_table = z > TABLE_TOP + 0.1 and max(abs(x - TABLE_MIDDLE), abs(y)) < TABLE_SIZE[0] / 2
        return not on_table or bool(np.hypot(x - CUBE_CENTRE[0], y) > 0.20)

    def save(self) -> int:
        """Keep the state of all bodies until the scene is closed, and return its number."""
        return int(pybullet.saveState(physicsClientId=self.client))

    def restore(self, state: int) -> None:
        """Set all bodies back to a state that was kept."""
        pybullet.restoreState(stateId=state, physicsClientId=self.client)

    @contextmanager
    def floor_in_sight(self) -> Iterator[None]:
        """Let the floor and the tables' feet be seen meanwhile."""
        for seen in (True, False):
            for body, position in self._scenery:
                place = position if seen else _OUT_OF_SIGHT
                pybullet.resetBasePositionAndOrientation(body, place, [0.0, 0.0, 0.0, 1.0], physicsClientId=self.client)
            if seen:
                yield

    def close(self) -> None:
        """Leave PyBullet; the scene cannot be used any more."""
        self._disconnect()

    def _apply(self, circumstances: Circumstances) -> None:
        """Set masses, frictions and the direction of gravity."""
        forwards, leftwards = np.sin(circumstances.lean)
        down = np.sqrt(1 - forwards**2 - leftwards**2)
        pybullet.setGravity(*(_GRAVITY * np.array([forwards, leftwards, -down])), physicsClientId=self.client)
        self.robot.set_pad_friction(circumstances.pad_friction, circumstances.pad_patch)
        mass = circumstances.cube_mass
        inertia = [mass * CUBE_SIZE**2 / 6] * 3
        for cube in self.cubes:
            pybullet.changeDynamics(
                cube.body,
                -1,
                mass=mass,
                localInertiaDiagonal=inertia,
                lateralFriction=circumstances.cube_friction,
                linearDamping=0.02,
                angularDamping=0.05,
                physicsClientId=self.client,
            )
        for table in self.tables:
            pybullet.changeDynamics(
                table, -1, lateralFriction=circumstances.table_friction, physicsClientId=self.client
            )

    def _build_table(self, origin: FloatArray) -> int:
        y = float(origin[1])
        self._put_up([0.05, 0.05, (TABLE_TOP + 0.46) / 2], [TABLE_MIDDLE, y, (TABLE_TOP - 0.54) / 2], _STEEL)
        return table_top(self.client, y)

    def _put_up(self, half_size: list[float], position: list[float], colour: tuple[float, ...]) -> None:
        """Put up a box that is touched where it is, and seen there while an observer looks."""
        touched = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half_size, physicsClientId=self.client)
        speck = pybullet.createVisualShape(pybullet.GEOM_SPHERE, radius=1e-4, physicsClientId=self.client)
        pybullet.createMultiBody(0, touched, speck, position, physicsClientId=self.client)
        self._scenery.append((slab(self.client, half_size, _OUT_OF_SIGHT, colour, solid=False), position))

    def _draw_rails(self, reach: float) -> None:
        for x in _RAILS:
            slab(self.client, [0.02, reach + 0.35, 0.0075], [x, 0.0, -0.4925], _STEEL, solid=False)
