"""How a fixed camera looks at the table: which way is up, and which is towards it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray
from atg_fg.senses.tags import DetectedTag, tag_facing

#: How far a webcam looks down on the table if nothing better is known, degrees.
USUAL_PITCH: Final = 35.0
#: Pose of a tag is not used to find directions if the other one that shows it alike is nearly as good.
_CLEAR = 0.6
_UPWARD, _PERPENDICULAR, _UPRIGHT = 0.25, 0.2, 0.9  # cosines


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """The table's directions in the camera's frame (x right, y down, z forward).

    Attributes:
        up: Unit vector, shape [3].
    """

    up: FloatArray

    @classmethod
    def pitched(cls, degrees: float) -> Viewpoint:
        """Return that of an upright camera that looks down by an angle.

        Raises:
            InvalidInputError: Not from 0 to below 90 degrees.
        """
        if not 0 <= degrees < 90:
            raise InvalidInputError(f"pitch of the camera: {degrees!r}; expected 0 to below 90 degrees")
        angle = math.radians(degrees)
        return cls(np.array([0.0, -math.cos(angle), -math.sin(angle)]))

    @classmethod
    def of_tags(cls, tags: Sequence[DetectedTag]) -> Viewpoint | None:
        """Return that under which a cube with these tags stands on a table; ``None`` where they do not say.

        Two faces of a cube must be seen; the one that looks up in the image is on top.
        """
        clear = [tag for tag in tags if tag.pose is not None and tag.pose.ambiguity < _CLEAR]
        top = min(clear, key=lambda tag: float(tag.normal[1]), default=None)
        if top is None or -top.normal[1] < _UPWARD or abs(top.normal[0]) > math.sqrt(1 - _UPRIGHT**2):
            return None
        others = [tag for tag in clear if tag is not top]
        return cls(top.normal) if any(abs(tag.normal @ top.normal) < _PERPENDICULAR for tag in others) else None

    @property
    def axes(self) -> FloatArray:
        """Rotation from the camera's frame to the table's (x away from the camera, y left, z up), shape [3, 3]."""
        away = np.array([0.0, 0.0, 1.0])
        away = away - (away @ self.up) * self.up
        away = away / np.linalg.norm(away)
        return np.stack([away, np.cross(self.up, away), self.up])

    def slots(self, tags: Sequence[DetectedTag]) -> Mapping[str, DetectedTag | None]:
        """Return the tag in front, towards the camera, and the one on top; ``None`` where there is none."""
        posed = [tag for tag in tags if tag.pose is not None]
        return {"front": tag_facing(posed, -self.axes[0]), "top": tag_facing(posed, self.up)}
