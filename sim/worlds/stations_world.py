"""Several cubes in one scene: the robot slides from station to station and turns the cube before it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from gymnasium import spaces

from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.core.patterns import IntArray
from atg_fg.worlds.arcube import ACTION_SOURCES, ORIENTATIONS, Cube, rotation_of
from atg_fg.worlds.stations import check_one_a_station, drawn_objects
from sim.bodies.cube import CUBE_CENTRE, CUBE_SIZE, nearest_orientation
from sim.vision.camera import Camera
from sim.worlds.film import observer_of
from sim.worlds.robonaut_arcube_world import RobonautARcubeWorld
from sim.worlds.scene import STATION_SPACING, PlacedCube

MOST_STATIONS: Final = 5
_N_TURNS: Final = len(ACTION_SOURCES)


@dataclass
class Presented:
    """What is at a station, as ``RobonautARcubeWorld`` knows its one cube.

    Attributes:
        object: Number of the cube.
        orientation: The nearest of the 24.
        lost: Whether the cube fell or could not be reached.
    """

    object: int
    orientation: int
    lost: bool = False


class RobonautTableWorld(RobonautARcubeWorld):
    """A Robonaut-like robot before a row of ARcubes, each on a table of its own; it slides sideways on a rail.

    ``flip``, ``left`` and ``right`` act on the cube at the station where the robot is; action 3 + k takes the robot to
    station k, arms raised, and lets it look there. Stations are numbered from the robot's left, where it begins. A lost
    cube stays so until the next reset; the episode ends when all are lost.

    ``reset(options={"objects": […], "orientations": […]})`` sets what is not to be drawn at random, one entry a
    station. Objects that are drawn are all different.

    ``info`` is that of ``RobonautARcubeWorld`` for the cube at this station, in the station's frame, with the number of
    the ``station``.

    Args:
        cubes: As for ``ARcubeWorld``.
        n_stations: 1 to 5.
        options: As for ``RobonautARcubeWorld``.

    Attributes:
        station: Where the robot is.
    """

    def __init__(self, cubes: Sequence[Cube] | None = None, *, n_stations: int = 3, **options: Any) -> None:
        if not isinstance(n_stations, (int, np.integer)) or not 1 <= n_stations <= MOST_STATIONS:
            raise InvalidInputError(f"n_stations: {n_stations!r}; expected 1 to {MOST_STATIONS}")
        self.n_stations = int(n_stations)
        self.station = 0
        self._presented = [Presented(0, 0) for _ in range(self.n_stations)]
        super().__init__(cubes, **options)
        self.action_space = spaces.Discrete(_N_TURNS + self.n_stations)

    def step(self, action: np.int64) -> tuple[IntArray, float, bool, bool, dict[str, Any]]:
        """Let the robot act on the cube before it, or go to another, and look.

        Raises:
            InvalidInputError: Not an action, or the cube here is lost.
        """
        self._check_action(action)
        if action < _N_TURNS:
            if self.lost:
                raise InvalidInputError(
                    f"step: the cube at station {self.station} is lost; expected to go to another station, or a reset"
                )
            observation, _, _, _, info = super().step(action)
        else:
            self._go(int(action) - _N_TURNS)
            observation, info = self._look(), self._truth(slipped=False)
        self._presented[self.station] = Presented(self.object, self.orientation, self.lost)
        return observation, 0.0, all(each.lost for each in self._presented), False, info

    def _go(self, station: int) -> None:
        """Slide to a station, unless the robot is there, and measure anew where its head is."""
        begun = self.scene.seconds
        if station != self.station:
            self.manipulator.slide(self.scene.rail_position(station))
        self.station = self.scene.station = station
        here = self._presented[station]
        self.object, self.lost = here.object, here.lost or self.scene.has_lost_the_cube()
        self.orientation, _ = nearest_orientation(self.scene.cube_pose()[1])
        self._outcome = {"simulated_seconds": self.scene.seconds - begun}
        self.camera, self._seen_at = self._head_camera(), -1

    def _present(self, options: dict[str, Any]) -> None:
        for name in options:
            if name not in ("objects", "orientations"):
                raise unknown_name("reset option", name, ("objects", "orientations"))
        objects = drawn_objects(options.get("objects"), self.n_stations, len(self.cubes), self.np_random)
        orientations = options.get("orientations")
        if orientations is None:
            orientations = self.np_random.integers(len(ORIENTATIONS), size=self.n_stations)
        check_one_a_station("orientations", orientations, self.n_stations)
        # Nothing is presented before all is found to be in order.
        self._presented = [
            Presented(
                self._chosen({"object": cube}, "object", len(self.cubes)),
                self._chosen({"orientation": orientation}, "orientation", len(ORIENTATIONS)),
            )
            for cube, orientation in zip(objects, orientations, strict=True)
        ]
        self.station, self.object, self.orientation = 0, self._presented[0].object, self._presented[0].orientation

    def _placed_cubes(self) -> list[PlacedCube]:
        return [
            PlacedCube(self.cubes[each.object], CUBE_CENTRE, rotation_of(each.orientation)) for each in self._presented
        ]

    def _perceive(self) -> None:
        """Take a frame, and leave out the tags of cubes that are not before the robot."""
        super()._perceive()
        self.markers = [
            marker
            for marker in self.markers
            if np.linalg.norm(marker.behind(CUBE_SIZE / 2) - CUBE_CENTRE) < STATION_SPACING / 2
        ]

    def _observer(self) -> Camera:
        return observer_of(self.n_stations)

    def _truth(self, *, slipped: bool) -> dict[str, Any]:
        return {**super()._truth(slipped=slipped), "station": self.station}

    def _state(self) -> dict[str, Any]:
        own = {"station": self.station, "object": self.object, "presented": self._presented, "camera": self.camera}
        return {**super()._state(), **own}

    def _set_state(self, kept: dict[str, Any]) -> None:
        super()._set_state(kept)
        self.station = self.scene.station = kept["station"]
        self.object, self._presented, self.camera = kept["object"], kept["presented"], kept["camera"]
        if self.scene.robot.rail is not None:
            self.scene.robot.rail.drive(self.scene.rail_position(self.station))
