"""The robot turns boxes without tags: depth says where a box stands, and its colours what it shows."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.object_sense import ObjectSense
from atg_fg.core.patterns import FloatArray
from atg_fg.senses.face_features import rectified
from atg_fg.worlds.arcube import Cube
from sim.bodies.cube import CUBE_SIZE
from sim.bodies.pictures import TYPICAL_WEIGHT, WEIGHT_SPREAD
from sim.bodies.tables import WOOD
from sim.manipulation.weighing import Scales, TorqueSensors
from sim.vision.camera import Light
from sim.vision.cube_pose import CubePose
from sim.vision.cuboid_fit import Cuboid, find_tabletop, points_of
from sim.vision.image_noise import in_usual_light
from sim.vision.picture_box_camera import outlined, shown_faces
from sim.worlds.domain_randomization import Circumstances
from sim.worlds.picture_box_world import BoxesWithPictures, beside
from sim.worlds.robonaut_world import RobonautWorld

#: What is found is a box of theirs if no side is off by more, m.
_SIZE_TOLERANCE: Final = 0.03
#: What the table's colours sum up to in usual light, grey levels.
_USUAL_TABLE: Final = 255 * sum(WOOD[:3]) * Light().on_top
#: Errors of torques do not grow with the weight. Their size is measured: docs/simulation.md.
_WEIGHT: Final = ObjectSense(
    "weight", TYPICAL_WEIGHT, TYPICAL_WEIGHT * WEIGHT_SPREAD, 0.035, unit="kg", relative=False, revealed_by=("flip",)
)
#: What a snapshot of this world has more than others.
_KEPT: Final = ("depth", "box", "crops", "seen", "weighed", "felt", "_feeling")


class RobonautPictureBoxWorld(RobonautWorld, BoxesWithPictures):
    """A Robonaut-like robot that flips and turns a box with pictures on a table.

    The camera in its head has depth too. Where to take hold comes from the depth image alone; what is shown, from the
    faces in front and on top, cut out of the colours where depth says they are. If no box is found, nothing is seen.

    Args:
        n_objects: As for ``BoxesWithPictures``.
        objects_seed: As for ``BoxesWithPictures``.
        weight: Whether each box has a weight of its own, not that of the condition, and a flip lets it be felt.
        image_size: (width, height) of the camera's frame, pixels.
        options: As for ``RobonautWorld`` and ``BoxesWithPictures``.

    Attributes:
        depth: The last depth image, shape [height, width], m; zero where nothing was measured.
        box: The box that was found in it, in the robot's frame, if one was.
        weighed: Its mass as felt in the last action, kg; ``None`` if it was not a flip, which holds it in the air.
    """

    field_of_view = 50.0  # wide enough for a box that is being turned

    def __init__(
        self,
        n_objects: int = 100,
        objects_seed: int = 0,
        *,
        weight: bool = False,
        image_size: tuple[int, int] = (400, 300),
        **options: Any,
    ) -> None:
        self.box: Cuboid | None = None
        self.weighed: float | None = None
        super().__init__(n_objects, objects_seed, image_size=image_size, weight=weight, weight_sense=_WEIGHT, **options)
        self.depth: NDArray[np.float32] = np.zeros(self.frame.shape[:2], dtype=np.float32)

    def camera_picture(self) -> NDArray[np.uint8]:
        """Return the last frame with the faces outlined that were found, and what was cut out beside it."""
        return beside(outlined(self.frame, self._found_faces()), self.crops)

    def errors(self) -> dict[str, float | None]:
        """Return how far off the truth the last look and the last action were: position, m, yaw, degrees, mass, kg.

        For scoring only. ``None`` stands for a box that was not found, or not weighed.
        """
        mass = None if self.weighed is None else self.weighed - self.circumstances.cube_mass
        if self.box is None:
            return {"position_error": None, "yaw_error": None, "mass_error": mass}
        position, rotation = self.scene.cube_pose()
        level = rotation[:, np.abs(rotation[2]).argmin()]
        yaw = (self.box.yaw - np.arctan2(level[1], level[0]) + np.pi / 4) % (np.pi / 2) - np.pi / 4
        return {
            "position_error": float(np.linalg.norm(self.box.centre - position)),
            "yaw_error": float(abs(np.degrees(yaw))),
            "mass_error": mass,
        }

    def _place(self) -> None:
        super()._place()
        self.weighed, self.felt = None, {}
        # Of its own, so that what is felt changes nothing of what is seen.
        self._feeling = np.random.default_rng(self.np_random.integers(2**63))
        self.scales = Scales(self.scene.robot, TorqueSensors.drawn(self._feeling))

    def _circumstances(self) -> Circumstances:
        drawn = super()._circumstances()
        return replace(drawn, cube_mass=float(self.boxes.weights[self.object])) if self.object_senses else drawn

    def _try(self, action: str) -> bool:
        self.scales.clear()
        self.controller.on_motion = self._feel if action == "flip" else None
        reachable = super()._try(action)
        self.weighed = self.scales.mass()
        self.felt = {} if self.weighed is None else {_WEIGHT.name: self.weighed}
        return reachable

    def _feel(self, angles: FloatArray, velocities: FloatArray, torques: FloatArray) -> None:
        """Weigh the box while it is in the air, from rest to rest."""
        if self.manipulator.phase == "approach":
            self.scales.tare(angles, velocities, torques, self._feeling)
        elif self.manipulator.phase == "turn":
            self.scales.feel(angles, velocities, torques, self._feeling)

    def _perceive(self) -> None:
        camera = self.camera.moved(self.scene.robot.place)
        imaging = self.circumstances.imaging
        self.frame, self.depth = imaging.frame_with_depth(camera, self.scene.client, self.np_random)
        self.box, light = None, 1.0
        if self.depth.any():
            found = find_tabletop(points_of(self.depth, self.camera))
            self.box = found.box if found.box is not None and _is_ours(found.box) else None
            if found.table.any():
                light = float(np.median(self.frame[found.table].sum(axis=1))) / _USUAL_TABLE
        faces = self._found_faces()
        self.seen[:] = len(faces) > 0
        usual = in_usual_light(self.frame, light)
        self.crops = np.array([rectified(usual, face) for face in faces]) if faces else np.zeros_like(self.crops)

    def _found_cube(self) -> CubePose | None:
        return None if self.box is None else CubePose(self.box.centre, self.box.yaw)

    def _found_faces(self) -> list[NDArray[np.float64]]:
        """Return the corners of what is in front and on top, each of shape [4, 2], pixels; nothing without a box."""
        return [] if self.box is None else shown_faces(self.camera, self.box.yaw, self.box.centre)

    def _truth(self, *, slipped: bool) -> dict[str, Any]:
        return {**super()._truth(slipped=slipped), "mass": self.circumstances.cube_mass}

    def _symbols(self) -> Cube:
        return (0, 1, 2, 3, 4, 5)

    def _pictures(self) -> list[NDArray[np.uint8]]:
        return [self.boxes.pictures[picture] for picture in self.boxes.faces[self.object]]

    def _state(self) -> dict[str, Any]:
        return {**super()._state(), **{name: getattr(self, name) for name in _KEPT}}

    def _set_state(self, kept: dict[str, Any]) -> None:
        super()._set_state(kept)
        for name in _KEPT:
            setattr(self, name, kept[name])


def _is_ours(box: Cuboid) -> bool:
    """Whether a box has the size of those that the robot knows how to hold."""
    return bool(np.abs(box.size - CUBE_SIZE).max() < _SIZE_TOLERANCE)
