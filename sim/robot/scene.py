"""The scene in PyBullet: floor, table, cube and robot; its clock, its circumstances, and snapshots of its state."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from pathlib import Path
from typing import Final

import numpy as np
import pybullet

from atg_fg.arcube import Cube
from atg_fg.patterns import FloatArray
from sim.cube_body import CUBE_CENTRE, CUBE_SIZE, CubeBody
from sim.robot.body import RobotBody
from sim.robot.conditions import Circumstances
from sim.robot.controller import TIME_STEP

TABLE_TOP: Final = float(CUBE_CENTRE[2]) - CUBE_SIZE / 2  # m
#: Of the table, m: a wider one would be in the forearms' way.
TABLE_SIZE: Final = (0.60, 0.60)
_TABLE_MIDDLE: Final = 0.50
_SOLVER_ITERATIONS: Final = 50
#: Contacts are looked at every so many steps.
_STEPS_PER_SAMPLE: Final = 8
_GRAVITY: Final = 9.81  # m/s²
_WOOD, _STEEL, _FLOOR = [0.62, 0.46, 0.30, 1.0], [0.45, 0.46, 0.48, 1.0], [0.80, 0.82, 0.84, 1.0]


class Scene:
    """A PyBullet client with the robot at its table and one cube.

    What PyBullet keeps of a scene is not quite all: after another trial, one that is set back to its beginning would
    not go the same way to the last bit. So every trial has a scene of its own.

    Args:
        circumstances: Masses, frictions, and how the floor leans.
        tags: The tags of the cube's faces.
        position: Of the cube's centre, shape [3], m.
        rotation: Of the cube, shape [3, 3].
        urdf: A user's own description of the robot.

    Attributes:
        steps: Steps of the simulation since the beginning.
        peak_force: Greatest normal force of either hand on the cube since it was last set to zero, N.
        self_contacts: Samples in which an arm touched the torso, the head or the other arm.
        on_step: Called after each step.
    """

    def __init__(
        self,
        circumstances: Circumstances,
        tags: Cube,
        position: FloatArray,
        rotation: FloatArray,
        urdf: Path | None = None,
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
        self.steps = self.self_contacts = 0
        self.peak_force = 0.0
        self.on_step: Callable[[], None] | None = None
        self._table = self._build_table()
        self.cube = CubeBody(self.client, circumstances.cube_mass)
        self.robot = RobotBody(self.client, urdf)
        self._apply(circumstances)
        self.cube.show(tags)
        self.cube.place(position, rotation)

    def advance(self) -> None:
        """Take the simulation one step on."""
        pybullet.stepSimulation(physicsClientId=self.client)
        self.steps += 1
        if self.steps % _STEPS_PER_SAMPLE == 0:
            forces = (self.robot.contact_force(hand, self.cube.body) for hand in range(2))
            self.peak_force = max(self.peak_force, *forces)
            self.self_contacts += self.robot.touches_itself()
        if self.on_step is not None:
            self.on_step()

    @property
    def seconds(self) -> float:
        """Simulated time since the beginning, s."""
        return self.steps * TIME_STEP

    def has_lost_the_cube(self) -> bool:
        """Whether the cube is off the table, or too far for the hands; by the simulator's truth."""
        (x, y, z), _ = self.cube.pose()
        on_table = z > TABLE_TOP + 0.1 and max(abs(x - _TABLE_MIDDLE), abs(y)) < TABLE_SIZE[0] / 2
        return not on_table or bool(np.hypot(x - CUBE_CENTRE[0], y) > 0.20)

    def save(self) -> int:
        """Keep the state of all bodies until the scene is closed, and return its number."""
        return int(pybullet.saveState(physicsClientId=self.client))

    def restore(self, state: int) -> None:
        """Set all bodies back to a state that was kept."""
        pybullet.restoreState(stateId=state, physicsClientId=self.client)

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
        pybullet.changeDynamics(
            self.cube.body,
            -1,
            mass=mass,
            localInertiaDiagonal=inertia,
            lateralFriction=circumstances.cube_friction,
            linearDamping=0.02,
            angularDamping=0.05,
            physicsClientId=self.client,
        )
        pybullet.changeDynamics(
            self._table, -1, lateralFriction=circumstances.table_friction, physicsClientId=self.client
        )

    def _build_table(self) -> int:
        half = [TABLE_SIZE[0] / 2, TABLE_SIZE[1] / 2, 0.02]
        self._slab([4.0, 4.0, 0.01], [0.0, 0.0, -0.51], _FLOOR)
        self._slab([0.05, 0.05, (TABLE_TOP + 0.46) / 2], [_TABLE_MIDDLE, 0.0, (TABLE_TOP - 0.54) / 2], _STEEL)
        return self._slab(half, [_TABLE_MIDDLE, 0.0, TABLE_TOP - half[2]], _WOOD)

    def _slab(self, half_size: list[float], position: list[float], colour: list[float]) -> int:
        seen = pybullet.createVisualShape(
            pybullet.GEOM_BOX, halfExtents=half_size, rgbaColor=colour, physicsClientId=self.client
        )
        solid = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=half_size, physicsClientId=self.client)
        return int(pybullet.createMultiBody(0, solid, seen, position, physicsClientId=self.client))
