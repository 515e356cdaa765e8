"""A cube with tags as a solid for 3D printers: a white body, and the black cells let into its faces."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from atg_fg.core.errors import InvalidInputError, needed_by
from atg_fg.core.patterns import FloatArray
from atg_fg.senses.tags import tag_cells
from atg_fg.worlds.arcube import FACE_NORMALS

#: How deep the black cells go, mm: a few layers of a printer.
INLAY: Final = 0.8
#: Which way is up on each face, in the order of ``atg_fg.worlds.arcube.FACES``; as on the printed net.
FACE_UPS: Final[FloatArray] = np.array([[0, 0, 1]] * 4 + [[1, 0, 0], [-1, 0, 0]], dtype=np.float64)
_GAP: Final = 10.0  # between cubes on the printer's bed, mm
_OVERLAP: Final = 0.02  # of cells that touch at a corner only, mm: a solid may not hang together by an edge


def check_solid_path(path: Path | str) -> str:
    """Return the format of a file of solids, ``"3mf"`` or ``"stl"``.

    Raises:
        InvalidInputError: Another suffix.
        MissingDependencyError: trimesh, or what it needs, is not installed.
    """
    _trimesh()
    kind = Path(path).suffix.lower().removeprefix(".")
    if kind not in ("3mf", "stl"):
        raise InvalidInputError(f"{path}: suffix {kind!r}; expected .3mf or .stl")
    return kind


def cube_solids(cubes: Sequence[Sequence[int]], dictionary: str, side: float, tag_size: float, kind: str) -> bytes:
    """Return cubes, side by side, as a file for a 3D printer.

    A 3MF file has a white and a black body for each cube, for a printer with two colours. An STL file has one body for
    each, with hollows where the black cells are to be painted.

    Args:
        cubes: Ids of the tags on the faces of each cube: front, back, left, right, top, bottom.
        dictionary: Of the tags.
        side: Of a cube, mm.
        tag_size: Side of a tag's black square, mm.
        kind: ``"3mf"`` or ``"stl"``.

    Raises:
        InvalidInputError: A tag too large for its face.
        MissingDependencyError: trimesh, or what it needs, is not installed.
    """
    trimesh = _trimesh()
    if not 2 * INLAY < tag_size < side - 4 * INLAY:
        raise InvalidInputError(f"tags of {tag_size:g} mm on a cube of {side:g} mm; expected smaller tags")
    scene = trimesh.Scene()
    for number, cube in enumerate(cubes):
        body = trimesh.creation.box((side,) * 3)
        cells = trimesh.boolean.union(_cells(trimesh, cube, dictionary, side, tag_size), engine="manifold")
        white = trimesh.boolean.difference([body, cells], engine="manifold")
        black = trimesh.boolean.intersection([body, cells], engine="manifold")
        for name, part, colour in (("white", white, (255, 255, 255, 255)), ("black", black, (20, 20, 20, 255))):
            if kind == "3mf" or name == "white":
                part.apply_translation((number * (side + _GAP), 0, side / 2))
                part.visual.face_colors = colour
                scene.add_geometry(part, geom_name=f"cube {number + 1} {name}")
    return bytes(scene.export(file_type=kind))


def _cells(trimesh: Any, cube: Sequence[int], dictionary: str, side: float, tag_size: float) -> list[Any]:
    """Return a box for each run of black cells, half of it outside of the cube."""
    boxes = []
    for tag_id, normal, up in zip(cube, FACE_NORMALS, FACE_UPS, strict=True):
        cells = tag_cells(dictionary, tag_id)
        cell = tag_size / len(cells)
        # Columns: right, up and outward on the face.
        place = np.eye(4)
        place[:3, :3] = np.column_stack([np.cross(up, normal), up, normal])
        for row, line in enumerate(cells):
            for begin, end in _runs(line == 0):
                box = trimesh.creation.box(((end - begin) * cell + _OVERLAP, cell + _OVERLAP, 2 * INLAY))
                x, y = (begin + end - len(cells)) / 2 * cell, (len(cells) / 2 - row - 0.5) * cell
                box.apply_translation((x, y, side / 2))
                box.apply_transform(place)
                boxes.append(box)
    return boxes


def _runs(black: Any) -> list[tuple[int, int]]:
    """Return beginning and end of each run of true values."""
    changes = np.flatnonzero(np.diff(np.concatenate([[False], black, [False]]).astype(np.int8))).tolist()
    return list(zip(changes[::2], changes[1::2], strict=True))


def _trimesh() -> Any:
    with needed_by("solids", "trimesh, lxml or manifold3d", "print"):
        import lxml  # noqa: F401  trimesh writes 3MF with it
        import manifold3d  # noqa: F401
        import trimesh
    return trimesh
