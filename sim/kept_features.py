"""``python -m sim.kept_features``: write the spaces of features that come with the package."""

from __future__ import annotations

from typing import Final

from atg_fg.senses.face_features import DEFAULT_FEATURES, VIEW_FEATURES
from sim.worlds import meshes_world, picture_box_world
from sim.worlds.feature_spaces import write_space

#: Name, features, and looks to calibrate them with.
KEPT: Final = (
    ("picture-box", DEFAULT_FEATURES, picture_box_world.calibration_looks),
    ("meshes", VIEW_FEATURES, meshes_world.calibration_looks),
)

if __name__ == "__main__":
    for each in KEPT:
        write_space(*each)
