"""Spaces of features of worlds without tags: those of their own features come with the package, others are calibrated.

``python -m sim.kept_features`` writes those that come with it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Final, TypeAlias

import numpy as np

from atg_fg.core.patterns import FloatArray
from atg_fg.senses.face_features import FaceFeatures, face_features
from atg_fg.senses.feature_space import FeatureSpace

#: Takes what makes features, and returns those of looks at objects that are in no world, shape [C, R, F].
CalibrationLooks: TypeAlias = Callable[[FaceFeatures], list[list[FloatArray]]]

#: Seed that these looks are drawn by.
CALIBRATION_SEED: Final = 987_654_321
_DIMENSIONS: Final = 24
_ARRAYS: Final = ("mean", "projection", "between")


@lru_cache(maxsize=4)
def feature_space(name: str, features: str, looks: CalibrationLooks) -> FeatureSpace:
    """Return the space of features that comes with the package; of other features one is calibrated, in seconds.

    Args:
        name: Of the file.
        features: As for ``face_features``.
        looks: To calibrate with.
    """
    with np.load(_path(name)) as kept:
        if kept["features"] == features:
            return FeatureSpace(features, *(kept[each] for each in _ARRAYS))
    return calibrated(features, looks)


def calibrated(features: str, looks: CalibrationLooks) -> FeatureSpace:
    """Return the space of features, calibrated on looks."""
    return FeatureSpace.calibrated(features, looks(face_features(features)), _DIMENSIONS)


def write_space(name: str, features: str, looks: CalibrationLooks) -> None:
    """Calibrate a space of features, and write the file that comes with the package."""
    space = calibrated(features, looks)
    arrays = {each: getattr(space, each) for each in _ARRAYS}
    np.savez_compressed(_path(name), features=np.array(features), **arrays)


def _path(name: str) -> Path:
    return Path(__file__).parent / "data" / f"{name}.npz"
