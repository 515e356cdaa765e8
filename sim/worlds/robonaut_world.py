"""The robot turns a cube: contact physics makes the next aspect, the head's camera sees it, and where the cube is."""

from __future__ import annotations

import copy
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Final, cast

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.worlds.arcube import ACTION_SOURCES, SUCCESSORS, Cube, rotation_of
from atg_fg.worlds.base import FiniteStateWorld
from sim.bodies.cube import CUBE_CENTRE, nearest_orientation
from sim.bodies.prepared_robot import PreparedRobot
from sim.manipulation.execution import Manipulator, OutOfReachError
from sim.manipulation.impedance_control import ArmController
from sim.manipulation.preparation import prepared
from sim.vision.camera import Camera
from sim.vision.cube_pose import CubePose
from sim.worlds.domain_randomization import Circumstances, condition_named
from sim.worlds.film import OBSERVER, Film, observed
from sim.worlds.rendered_world import checked_size
from sim.worlds.scene import PlacedCube, Scene
from sim.worlds.scene_viewer import SceneViewer

#: An action is right if it leaves the cube this near to where it should, degrees and m.
RIGHT_ANGLE: Final = 20.0
RIGHT_DISTANCE: Final = 0.06
#: How far from its place a cube may be put at the beginning of a trial, m.
LARGEST_OFFSET: Final = 0.03
_NEAR: Final = 0.25  # m from the eye: beyond the visor, before the hands
_SETTLING: Final = 0.25  # s
_ACTIONS: Final = tuple(ACTION_SOURCES)


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A world between two actions, as ``RobonautWorld.save`` keeps it.

    Attributes:
        scene: The trial's scene; no other can be set back to this.
        state: Number of the bodies' state in it.
        world: What the world and its controller hold.
    """

    scene: Scene
    state: int
    world: dict[str, Any]


class RobonautWorld(FiniteStateWorld):
    """A Robonaut-like robot that flips and turns a cube on a table, by friction alone.

    The robot sees the cube through the camera in its head only. ``info`` tells the truth, for scoring. A cube that fell
    or cannot be reached any more ends the episode: ``terminated`` is true and ``info["lost"]`` says so.

    A subclass is a world of cubes as well, and says what is on their faces and what the robot makes of what it sees.

    ``reset(options=…)`` takes ``object`` and ``orientation``, and ``position``: (x, y) of the cube's centre, m.

    Args:
        objects: As for the world of cubes, like ``options``.
        condition: Name of a condition in ``sim.worlds.domain_randomization``.
        urdf: A user's own description of the robot, or one made ready, instead of the shell.
        image_size: (width, height) of the head camera's frame, pixels.
        render_mode: ``"rgb_array"``, seen by an observer; ``"head"``, the last frame of the head's camera;
            ``"detections"``, the same with what was found in it outlined; ``"rgb_array_list"``, a film of all that
            happened since it was last asked for, seen by an observer, with what the head sees in a corner.

    Attributes:
        frame: The last frame of the head's camera, RGB, shape [height, width, 3].
        circumstances: What was drawn for this trial.
        camera: The head's, in the robot's frame.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 - gymnasium declares it so
        "render_modes": ["rgb_array", "head", "detections", "rgb_array_list"],
        "render_fps": 10,
    }
    field_of_view: ClassVar[float] = 40.0  # of the camera, vertical, degrees

    def __init__(
        self,
        *objects: Any,
        condition: str = "nominal",
        urdf: str | Path | PreparedRobot | None = None,
        image_size: tuple[int, int] = (320, 240),
        render_mode: str | None = None,
        **options: Any,
    ) -> None:
        super().__init__(*objects, render_mode=render_mode, **options)
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise unknown_name("render mode", render_mode, self.metadata["render_modes"])
        self.condition = condition_named(condition)
        self._image_size = checked_size(image_size)
        self.circumstances = Circumstances()
        self._robot = prepared(Path(urdf)) if isinstance(urdf, (str, Path)) else urdf
        self.object, self.state, self._position = 0, 0, CUBE_CENTRE
        self._build()
        self.camera = self._head_camera()
        self.frame: NDArray[np.uint8] = np.zeros((*self._image_size[::-1], 3), dtype=np.uint8)
        self.lost = False
        self._seen_at = -1
        self._outcome: dict[str, Any] = {}
        self._film = Film(self.metadata["render_fps"]) if render_mode == "rgb_array_list" else None
        self._viewer: SceneViewer | None = None

    @abstractmethod
    def camera_picture(self) -> NDArray[np.uint8]:
        """Return the last frame of the head's camera with what was found in it, whatever the render mode."""

    @abstractmethod
    def _symbols(self) -> Cube:
        """Return the symbol on each face of the cube that is presented."""

    def _pictures(self) -> Sequence[NDArray[np.uint8]] | None:
        """Return what each symbol looks like, RGB; ``None`` if they are tags."""
        return None

    @abstractmethod
    def _perceive(self) -> None:
        """Take a frame with the head's camera, and find the cube in it."""

    @abstractmethod
    def _found_cube(self) -> CubePose | None:
        """Return where the cube was found in the last frame, ``None`` if it was not."""

    def step(self, action: np.int64) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Let the robot act and look.

        Raises:
            InvalidInputError: Not an action, or the cube is lost and the world was not reset.
        """
        self._check_action(action)
        if self.lost:
            raise InvalidInputError("step: the cube is lost; expected a reset first")
        before, begun, squarings = self.state, self.scene.seconds, self.manipulator.squarings
        self.scene.peak_force = 0.0
        reachable = self._try(_ACTIONS[int(action)])
        self.lost = not reachable or self.scene.has_lost_the_cube()
        self.state, _ = nearest_orientation(self.scene.cube_pose()[1])
        self._outcome = {
            **self._score(SUCCESSORS[before][int(action)]),
            "peak_force": self.scene.peak_force,
            "squarings": self.manipulator.squarings - squarings,
            "simulated_seconds": self.scene.seconds - begun,
        }
        return self._look(), 0.0, self.lost, False, self._truth(slipped=self.state == before)

    def render(self) -> Any:
        """Return a picture, RGB, shape [height, width, 3], or a film as a list of them; ``None`` without a mode."""
        if self.render_mode == "rgb_array":
            return observed(self.scene, self._observer())
        if self.render_mode == "head":
            return self.frame.copy()
        if self.render_mode == "detections":
            return self.camera_picture()
        return None if self._film is None else self._film.take()

    def show_in(self, recording: Any) -> None:
        """Show the scene of each trial from the next reset on in a Rerun recording (``sim.worlds.scene_viewer``)."""
        self._viewer = SceneViewer(recording)

    def save(self) -> Snapshot:
        """Keep the whole state of the world between two actions of a trial, its random generator included."""
        return Snapshot(self.scene, self.scene.save(), copy.deepcopy(self._state()))

    def restore(self, snapshot: Snapshot) -> None:
        """Go back to a state that ``save`` kept; what follows is the same, bit for bit.

        Raises:
            InvalidInputError: The state is of another trial; every reset begins one.
        """
        if snapshot.scene is not self.scene:
            raise InvalidInputError("restore: the state is of another trial; expected one kept since the last reset")
        self.scene.restore(snapshot.state)
        self._set_state(copy.deepcopy(snapshot.world))

    def close(self) -> None:
        """Leave PyBullet; the world cannot be used any more."""
        self.scene.close()

    def _state(self) -> dict[str, Any]:
        return {
            "state": self.state,
            "lost": self.lost,
            "steps": self.scene.steps,
            "seen_at": self._seen_at,
            "reference": self.controller.reference,
            "feedforward": self.controller.feedforward,
            "frame": self.frame,
            "outcome": self._outcome,
            "generator": self.np_random,
        }

    def _set_state(self, kept: dict[str, Any]) -> None:
        self.state, self.lost = kept["state"], kept["lost"]
        self.scene.steps, self._seen_at = kept["steps"], kept["seen_at"]
        self.controller.reference, self.controller.feedforward = kept["reference"], kept["feedforward"]
        self.frame, self._outcome = kept["frame"], kept["outcome"]
        self.np_random = kept["generator"]

    def _check_action(self, action: np.int64) -> None:
        if not self.action_space.contains(action):
            n_actions = cast(spaces.Discrete, self.action_space).n
            raise InvalidInputError(f"action: {action!r}; expected 0 to {n_actions - 1}")

    def _present(self, options: dict[str, Any]) -> None:
        self._position = _checked_position(options.get("position", CUBE_CENTRE[:2]))
        super()._present({name: chosen for name, chosen in options.items() if name != "position"})

    def _place(self) -> None:
        """Begin a trial: draw its circumstances and stand the cube on the table."""
        self.scene.close()
        self.circumstances = self._circumstances()
        self.lost, self._seen_at, self._outcome = False, -1, {}
        self._build()
        self.controller.hold(_SETTLING)
        self.camera = self._head_camera()
        if self._film is not None:
            self._film.begin(self.scene, self.camera_picture, self._observer)
        if self._viewer is not None:
            self._viewer.begin(self.scene, [cube.symbols for cube in self._placed_cubes()], self._pictures())

    def _circumstances(self) -> Circumstances:
        """Draw the circumstances of a trial."""
        return self.condition.draw(self.np_random)

    def _build(self) -> None:
        """Make the scene anew, and the robot's control of it."""
        self.scene = Scene(self.circumstances, self._placed_cubes(), self._robot, self._pictures())
        self.controller = ArmController(self.scene.robot, self.scene.advance)
        self.manipulator = Manipulator(self.controller, self._look_for_cube)

    def _placed_cubes(self) -> list[PlacedCube]:
        """Return what stands at each station when a trial begins."""
        return [PlacedCube(self._symbols(), self._position, rotation_of(self.state))]

    def _try(self, action: str) -> bool:
        """Carry an action out; return whether the robot could reach the cube."""
        try:
            self.manipulator.act(action)
        except OutOfReachError:
            self.manipulator.go_home()
            return False
        return True

    def _score(self, expected_orientation: int) -> dict[str, Any]:
        """Return how near the cube is to where the action should have left it."""
        position, rotation = self.scene.cube_pose()
        between = rotation @ rotation_of(expected_orientation).T
        angle = float(np.degrees(np.arccos(np.clip((np.trace(between) - 1) / 2, -1, 1))))
        distance = float(np.linalg.norm(position - CUBE_CENTRE))
        return {
            "expected_orientation": expected_orientation,
            "right": angle <= RIGHT_ANGLE and distance <= RIGHT_DISTANCE and not self.lost,
            "angle_error": angle,
            "position_error": distance,
        }

    def _look(self) -> Any:
        self._see()
        if self._viewer is not None:
            self._viewer.look(self.camera.moved(self.scene.robot.place), self.camera_picture())
        return super()._look()

    def _see(self) -> None:
        """Take a frame, unless nothing has moved since the last one."""
        if self._seen_at == self.scene.steps:
            return
        self._perceive()
        self._seen_at = self.scene.steps

    def _look_for_cube(self) -> CubePose:
        """Return where the cube is seen; a robot that does not see it takes it to be where it should."""
        self._see()
        return self._found_cube() or CubePose(CUBE_CENTRE, 0.0)

    def _head_camera(self) -> Camera:
        eye, direction = self.scene.robot.eye()
        target = eye + direction
        return Camera(tuple(eye.tolist()), tuple(target.tolist()), self.field_of_view, self._image_size, _NEAR)

    def _observer(self) -> Camera:
        return OBSERVER

    def _truth(self, *, slipped: bool) -> dict[str, Any]:
        position, rotation = self.scene.cube_pose()
        _, tilt = nearest_orientation(rotation)
        return {
            **super()._truth(slipped=slipped),
            "lost": self.lost,
            "position": tuple(position.tolist()),
            "angle_from_orientation": float(np.degrees(tilt)),
            **self._outcome,
        }


def _checked_position(position: Any) -> NDArray[np.float64]:
    """Return the cube's centre for reset option ``position``, or raise ``InvalidInputError``."""
    place = np.asarray(position, dtype=np.float64) if np.ndim(position) == 1 else np.zeros(0)
    if place.shape != (2,) or not np.abs(place - CUBE_CENTRE[:2]).max() <= LARGEST_OFFSET:
        ranges = (f"{middle - LARGEST_OFFSET:.2f} to {middle + LARGEST_OFFSET:.2f} m" for middle in CUBE_CENTRE[:2])
        raise InvalidInputError(
            f"reset option 'position': {position!r}; expected (x, y) in the hands' reach: {', '.join(ranges)}"
        )
    return np.array([*place, CUBE_CENTRE[2]])
