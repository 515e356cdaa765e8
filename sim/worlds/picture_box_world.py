"""Boxes with pictures before a camera: turned kinematically, each look rendered anew, read without tags."""

from __future__ import annotations

from typing import Any, Final

import cv2
import numpy as np
from numpy.typing import NDArray

from atg_fg.core.object_sense import ObjectSense
from atg_fg.core.patterns import FloatArray, PatternAlphabet
from atg_fg.senses.face_features import CROP, DEFAULT_FEATURES, FaceFeatures
from atg_fg.senses.feature_space import FeatureSpace
from atg_fg.worlds.arcube import (
    ACTION_SOURCES,
    FACES,
    FRONT,
    ORIENTATIONS,
    TOP,
    rotation_of,
    shown_pattern,
)
from sim.bodies.pictures import TYPICAL_WEIGHT, WEIGHT_SPREAD, Difference, draw_picture, make_picture_boxes
from sim.vision.camera import Camera
from sim.vision.picture_box_camera import PictureBoxCamera
from sim.worlds.appearance_world import AppearanceWorld
from sim.worlds.feature_spaces import CALIBRATION_SEED, feature_space
from sim.worlds.kinematic_world import KinematicWorld
from sim.worlds.rendered_world import checked_size

#: Numbers that classes of appearance can have.
MOST_CLASSES: Final = 48
_SLOTS: Final = ("front", "top")
#: Boxes whose pictures calibrate the features, each seen in all its orientations.
_CALIBRATION_BOXES: Final = 24
#: How much more looks at one picture scatter than on average over pictures, and than those that were calibrated on.
_WITHIN: Final = 3.0


class BoxesWithPictures(AppearanceWorld):
    """Boxes with pictures: the slots are what is in front and on top.

    Args:
        n_objects: How many boxes there are.
        objects_seed: Seed that they and their pictures are drawn by.
        look_alikes: Share of the boxes that look like another one.
        differ_in: What tells these from it: a single ``"face"``, or their ``"weight"`` alone.
        features: ``"colours-and-gradients"``, or ``module:function`` of a user's own.
        options: As for ``AppearanceWorld``.

    Attributes:
        boxes: The boxes, and the pictures on them.
    """

    within = _WITHIN

    def __init__(
        self,
        n_objects: int = 100,
        objects_seed: int = 0,
        *,
        look_alikes: float = 0.1,
        differ_in: Difference = "face",
        features: str = DEFAULT_FEATURES,
        **options: Any,
    ) -> None:
        self.boxes = make_picture_boxes(n_objects, objects_seed, look_alikes=look_alikes, differ_in=differ_in)
        alphabet = PatternAlphabet(_SLOTS, MOST_CLASSES, exclusive=False)
        super().__init__(n_objects, alphabet, features=features, side=CROP, **options)

    def feature_space(self) -> FeatureSpace:
        """Return the space of features, calibrated on pictures that are on no box of any world."""
        return feature_space("picture-box", self.features_name, calibration_looks)

    def _pattern(self) -> tuple[int, ...]:
        return shown_pattern(self.boxes.faces[self.object], self.state)


class PictureBoxWorld(KinematicWorld, BoxesWithPictures):
    """One of many boxes with pictures that three actions turn by quarter turns: flip, left, right.

    Args:
        n_objects: How many boxes there are.
        objects_seed: Seed that they and their pictures are drawn by.
        look_alikes: Share of the boxes that look like another one.
        differ_in: What tells these from it: a single ``"face"``, or their ``"weight"`` alone.
        weight: Whether the weight is felt.
        weight_error: Standard deviation of readings of a weight, as a share of it.
        features: ``"colours-and-gradients"``, or ``module:function`` of a user's own.
        slip: Probability that an action fails and the box stays as it is.
        missing: Probability, for each slot alone, that it is not seen.
        image_size: (width, height) of the frame, pixels.
        render_mode: As for ``KinematicWorld``.
        jitter: ``position_jitter``, ``yaw_jitter``, ``light_jitter``, ``image_noise`` and ``blur`` of ``ObjectCamera``.

    Attributes:
        crops: The faces in front and on top that were cut out of it, RGB, shape [2, side, side, 3].

    Raises:
        InvalidInputError: An option out of its range.
    """

    camera: PictureBoxCamera

    def __init__(
        self,
        n_objects: int = 100,
        objects_seed: int = 0,
        *,
        look_alikes: float = 0.1,
        differ_in: Difference = "face",
        weight: bool = False,
        weight_error: float = 0.08,
        features: str = DEFAULT_FEATURES,
        slip: float = 0.0,
        missing: float = 0.0,
        image_size: tuple[int, int] = (320, 240),
        render_mode: str | None = None,
        **jitter: float,
    ) -> None:
        actions = tuple(ACTION_SOURCES)
        super().__init__(
            n_objects,
            objects_seed,
            look_alikes=look_alikes,
            differ_in=differ_in,
            features=features,
            weight=weight,
            weight_sense=ObjectSense(
                "weight", TYPICAL_WEIGHT, WEIGHT_SPREAD, weight_error, unit="kg", revealed_by=actions
            ),
            slip=slip,
            missing=missing,
            camera=PictureBoxCamera(Camera(image_size=checked_size(image_size)), **jitter),
            render_mode=render_mode,
        )

    def camera_picture(self) -> NDArray[np.uint8]:
        """Return the last camera frame with what was cut out of it beside it, front below top, whatever the mode."""
        return beside(self.camera.outlined(self.frame), self.crops)

    def _weight(self) -> float:
        return float(self.boxes.weights[self.object])

    def _look(self) -> dict[str, NDArray[Any]]:
        """Take a frame, and return the features of what is in front and on top of it."""
        pictures = [self.boxes.pictures[picture] for picture in self.boxes.faces[self.object]]
        self.frame = self.camera.frame(pictures, rotation_of(self.state), self.np_random)
        self.crops = self.camera.crops(self.frame)
        return super()._look()


def beside(picture: NDArray[np.uint8], crops: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return a picture with what was cut out of it, shape [2, side, side, 3], to its right: front below top."""
    height = picture.shape[0]
    side = height // len(crops)
    large = [cv2.resize(crop, (side, side), interpolation=cv2.INTER_NEAREST) for crop in crops[::-1]]
    column = np.vstack(large)
    column = np.pad(column, ((0, height - len(column)), (0, 0), (0, 0)), constant_values=255)
    return np.hstack([picture, np.asarray(column, dtype=np.uint8)])


def calibration_looks(make: FaceFeatures) -> list[list[FloatArray]]:
    """Return features of looks at pictures that are on no box of any world: eight at each of 144 pictures."""
    camera, rng = PictureBoxCamera(Camera()), np.random.default_rng(CALIBRATION_SEED)
    looks: list[list[FloatArray]] = []
    for _ in range(_CALIBRATION_BOXES):
        pictures = [draw_picture(rng) for _ in FACES]
        of_face: list[list[FloatArray]] = [[] for _ in FACES]
        for orientation, faces in enumerate(ORIENTATIONS):
            crops = camera.crops(camera.frame(pictures, rotation_of(orientation), rng))
            for place, crop in zip((FRONT, TOP), crops, strict=True):
                of_face[faces[place]].append(make(crop))
        looks += of_face
    return looks
