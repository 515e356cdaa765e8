"""Conditions that the robot works under, and what is drawn from them for each trial."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from atg_fg.core.errors import unknown_name
from sim.vision.image_noise import Imaging

_GOOD_CAMERA: Final = Imaging(light_jitter=0.2, image_noise=5.0)
_POOR_CAMERA: Final = Imaging(light_jitter=0.6, image_noise=20.0, blur=0.7, depth_noise=2.0)


@dataclass(frozen=True)
class Circumstances:
    """The physics and the light of one trial.

    Attributes:
        cube_mass: kg.
        pad_friction: Coefficient of friction of the pads; Bullet multiplies it with the cube's.
        pad_patch: Radius of the patch by which a pad resists being twisted on a face, m.
        cube_friction: Coefficient of friction of the cube.
        table_friction: Coefficient of friction of the table.
        lean: How far the floor leans forwards and to the left, shape (2,), rad.
        imaging: Light and noise of the camera.
    """

    cube_mass: float = 0.8
    pad_friction: float = 1.2
    pad_patch: float = 0.03
    cube_friction: float = 0.8
    table_friction: float = 0.4
    lean: tuple[float, float] = (0.0, 0.0)
    imaging: Imaging = _GOOD_CAMERA


@dataclass(frozen=True)
class Condition:
    """Ranges that circumstances are drawn from, uniformly and each alone.

    Attributes:
        summary: One line for people.
        cube_mass: From, to, kg.
        pad_friction: From, to.
        pad_patch: From, to, m.
        largest_lean: Of the floor, rad.
        imaging: Light and noise of the camera.
    """

    summary: str
    cube_mass: tuple[float, float]
    pad_friction: tuple[float, float]
    pad_patch: tuple[float, float]
    largest_lean: float
    imaging: Imaging

    def draw(self, rng: np.random.Generator) -> Circumstances:
        """Return the circumstances of one trial."""
        ranges = (self.cube_mass, self.pad_friction, self.pad_patch)
        mass, friction, patch = (float(rng.uniform(*ends)) for ends in ranges)
        forwards, leftwards = (float(rng.uniform(-1, 1)) * self.largest_lean for _ in range(2))
        return Circumstances(mass, friction, patch, lean=(forwards, leftwards), imaging=self.imaging)


CONDITIONS: Final[dict[str, Condition]] = {
    "nominal": Condition(
        "rubber pads in good order, a cube of 0.8 kg, a steady floor, a good camera",
        cube_mass=(0.8, 0.8),
        pad_friction=(1.2, 1.2),
        pad_patch=(0.03, 0.03),
        largest_lean=0.0,
        imaging=_GOOD_CAMERA,
    ),
    "worn": Condition(
        "polished pads, a cube of unknown mass, a floor that leans, a poor camera",
        cube_mass=(0.5, 3.0),
        pad_friction=(0.10, 0.50),
        pad_patch=(0.001, 0.030),
        largest_lean=0.05,
        imaging=_POOR_CAMERA,
    ),
}


def condition_named(name: str) -> Condition:
    """Return the condition named ``name``, or raise ``UnknownNameError``."""
    if name not in CONDITIONS:
        raise unknown_name("condition", name, CONDITIONS)
    return CONDITIONS[name]
