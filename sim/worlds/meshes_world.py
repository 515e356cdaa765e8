"""Things of odd shapes before a camera: turned kinematically, each look rendered anew, the whole view as one slot."""

from __future__ import annotations

from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from atg_fg.core.object_sense import ObjectSense
from atg_fg.core.patterns import FloatArray, PatternAlphabet
from atg_fg.senses.face_features import VIEW, VIEW_FEATURES, FaceFeatures
from atg_fg.senses.feature_space import FeatureSpace
from atg_fg.worlds.arcube import ACTION_SOURCES, ORIENTATIONS, rotation_of
from sim.bodies.meshes import DENSITY_SPREAD, TYPICAL_WEIGHT, calibration_meshes, make_meshes
from sim.vision.camera import Camera
from sim.vision.mesh_camera import MeshCamera
from sim.worlds.feature_spaces import CALIBRATION_SEED, feature_space
from sim.worlds.kinematic_world import KinematicWorld
from sim.worlds.rendered_world import checked_size

#: Numbers that classes of appearance can have: each way in which a thing can lie looks otherwise.
MOST_CLASSES: Final = 1000
#: Things that calibrate the features, and looks at each of their orientations.
_CALIBRATION_THINGS, _LOOKS = 20, 3
#: Standard deviation of the logarithm of weights: of densities, and of the volumes of bounding boxes.
_WEIGHT_SPREAD: Final = float(np.hypot(DENSITY_SPREAD, 0.75))
_SIZE: Final = (160, 120)


class MeshesWorld(KinematicWorld):
    """One of many things of one grey that three actions turn by quarter turns: flip, left, right.

    A thing has no faces: what is seen is one slot, ``view``.

    Args:
        n_objects: How many things there are, at most 900.
        objects_seed: Seed that they are drawn by.
        weight: Whether the weight is felt.
        weight_error: Standard deviation of readings of a weight, as a share of it.
        features: ``"grid-and-gradients"``, or ``module:function`` of a user's own.
        slip: Probability that an action fails and the thing stays as it is.
        missing: Probability that nothing is seen.
        image_size: (width, height) of the frame, pixels.
        render_mode: As for ``KinematicWorld``.
        jitter: ``position_jitter``, ``yaw_jitter``, ``light_jitter``, ``image_noise`` and ``blur`` of ``ObjectCamera``.

    Attributes:
        meshes: The things.

    Raises:
        InvalidInputError: An option out of its range.
        MissingDependencyError: The meshes are not installed.
    """

    camera: MeshCamera

    def __init__(
        self,
        n_objects: int = 100,
        objects_seed: int = 0,
        *,
        weight: bool = False,
        weight_error: float = 0.08,
        features: str = VIEW_FEATURES,
        slip: float = 0.0,
        missing: float = 0.0,
        image_size: tuple[int, int] = _SIZE,
        render_mode: str | None = None,
        **jitter: float,
    ) -> None:
        self.meshes = make_meshes(n_objects, objects_seed)
        actions = tuple(ACTION_SOURCES)
        super().__init__(
            n_objects,
            PatternAlphabet(("view",), MOST_CLASSES),
            features=features,
            side=VIEW,
            weight=weight,
            weight_sense=ObjectSense(
                "weight", TYPICAL_WEIGHT, _WEIGHT_SPREAD, weight_error, unit="kg", revealed_by=actions
            ),
            slip=slip,
            missing=missing,
            camera=MeshCamera(Camera(image_size=checked_size(image_size)), **jitter),
            render_mode=render_mode,
        )

    def feature_space(self) -> FeatureSpace:
        """Return the space of features, calibrated on things that are in no world."""
        return feature_space("meshes", self.features_name, calibration_looks)

    def camera_picture(self) -> NDArray[np.uint8]:
        """Return the last camera frame with what was cut out of it to its right, whatever the mode."""
        side = self.frame.shape[0]
        return np.hstack([self.frame, np.asarray(cv2.resize(self.crops[0], (side, side)), dtype=np.uint8)])

    def _weight(self) -> float:
        return self.meshes[self.object].weight

    def _pattern(self) -> tuple[int, ...]:
        return (self.object * len(ORIENTATIONS) + self.state,)

    def _look(self) -> dict[str, NDArray[Any]]:
        """Take a frame, and return the features of what is no table, and what was felt."""
        self.frame = self.camera.frame(self.meshes[self.object], rotation_of(self.state), self.np_random)
        self.crops = self.camera.view(self.frame)[None]
        return super()._look()


def calibration_looks(make: FaceFeatures) -> list[list[FloatArray]]:
    """Return features of looks at things that are in no world: three at each of 480 ways in which one lies."""
    camera, rng = MeshCamera(Camera(image_size=_SIZE)), np.random.default_rng(CALIBRATION_SEED)
    looks: list[list[FloatArray]] = []
    for mesh in calibration_meshes(_CALIBRATION_THINGS, rng):
        for orientation in range(len(ORIENTATIONS)):
            frames = [camera.frame(mesh, rotation_of(orientation), rng) for _ in range(_LOOKS)]
            looks.append([make(camera.view(frame)) for frame in frames])
    camera.close()
    return looks
