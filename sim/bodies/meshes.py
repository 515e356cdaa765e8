"""Things of odd shapes, all of one grey: the random meshes that come with PyBullet, and what they weigh."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Final

import numpy as np

from atg_fg.core.checks import whole_number
from atg_fg.core.errors import MissingDependencyError
from atg_fg.core.patterns import FloatArray

#: Meshes that there are; the last ones calibrate features, and are in no world.
N_MESHES: Final = 1000
N_FOR_CALIBRATION: Final = 100
#: Greatest extent of a thing, m, from 80 % of it to all.
_EXTENT: Final = 0.30
_LEAST_SHARE: Final = 0.8
#: Weight of a bounding box that is as large as most, kg, and standard deviation of the logarithm of density.
TYPICAL_WEIGHT: Final = 0.6
DENSITY_SPREAD: Final = 0.35
_TYPICAL_VOLUME: Final = 0.0065  # m³


@dataclass(frozen=True, eq=False)
class Mesh:
    """A thing.

    Attributes:
        path: Of its shape, an OBJ file.
        scale: From the file's units to metres.
        middle: Of its bounding box, in the file's units, shape [3].
        vertices: About the middle, m, shape [V, 3].
        weight: kg.
    """

    path: Path
    scale: float
    middle: FloatArray
    vertices: FloatArray
    weight: float


def make_meshes(n: int, seed: int) -> list[Mesh]:
    """Return different things, drawn with their sizes and weights by a seed.

    Raises:
        InvalidInputError: A number out of range.
        MissingDependencyError: The meshes are not installed.
    """
    most = N_MESHES - N_FOR_CALIBRATION
    whole_number(n, "n_objects", 1, most)
    rng = np.random.default_rng(whole_number(seed, "objects_seed", 0))
    return [_mesh(number, rng) for number in rng.permutation(most)[:n].tolist()]


def calibration_meshes(n: int, rng: np.random.Generator) -> list[Mesh]:
    """Return ``n`` things that are in no world, with sizes and weights drawn by ``rng``."""
    return [_mesh(N_MESHES - 1 - number, rng) for number in range(n)]


def _mesh(number: int, rng: np.random.Generator) -> Mesh:
    path = _folder() / f"{number:03d}" / f"{number:03d}.obj"
    points = _points_of(path)
    middle = (points.max(axis=0) + points.min(axis=0)) / 2
    scale = _EXTENT * float(rng.uniform(_LEAST_SHARE, 1.0)) / float(np.ptp(points, axis=0).max())
    vertices = (points - middle) * scale
    volume = float(np.ptp(vertices, axis=0).prod())
    weight = TYPICAL_WEIGHT * volume / _TYPICAL_VOLUME * float(np.exp(DENSITY_SPREAD * rng.standard_normal()))
    return Mesh(path, scale, middle, vertices, weight)


def _folder() -> Path:
    """Return the folder of the meshes; set-ups without PyBullet's sample models lack it."""
    try:
        from pybullet_data import getDataPath
    except ImportError:
        folder = None
    else:
        folder = Path(getDataPath()) / "random_urdfs"
    if folder is None or not os.path.isdir(folder):
        raise MissingDependencyError(
            "world 'meshes': the random meshes of PyBullet are not installed; expected its sample models, as they come "
            "with it: pip install --force-reinstall --no-deps pybullet"
        )
    return folder


@lru_cache(maxsize=256)
def _points_of(path: Path) -> FloatArray:
    """Return the vertices in an OBJ file, shape [V, 3]."""
    lines = (line.split() for line in path.read_text().splitlines() if line.startswith("v "))
    return np.array([[float(value) for value in words[1:4]] for words in lines])
