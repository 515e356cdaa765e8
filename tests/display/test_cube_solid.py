import numpy as np
import pytest

pytest.importorskip("cv2", reason="OpenCV is not installed: pip install atg-fg[vision]")
trimesh = pytest.importorskip("trimesh", reason="trimesh is not installed: pip install atg-fg[print]")
pytest.importorskip("manifold3d")

import io

from atg_fg.core.errors import InvalidInputError
from atg_fg.display.cube_solid import FACE_UPS, INLAY, check_solid_path, cube_solids
from atg_fg.senses.tags import tag_cells
from atg_fg.worlds.arcube import FACE_NORMALS

CUBE = (0, 1, 2, 3, 4, 5)


def crossings(triangles, point, direction):
    """How often a ray goes through a surface; an odd number if it begins inside."""
    first, second, third = triangles.transpose(1, 0, 2)
    direction = direction + np.array([1e-4, 2e-4, 3e-4])  # through no edge
    across, along = second - first, third - first
    normal = np.cross(direction, along)
    determinant = (across * normal).sum(axis=1)
    determinant[abs(determinant) < 1e-12] = np.inf
    from_first = point - first
    u = (from_first * normal).sum(axis=1) / determinant
    other = np.cross(from_first, across)
    v = other @ direction / determinant
    distance = (along * other).sum(axis=1) / determinant
    return int(((u > 0) & (v > 0) & (u + v < 1) & (distance > 0)).sum())


def test_a_3mf_file_has_a_white_and_a_black_body_that_fill_the_cube():
    scene = trimesh.load(io.BytesIO(cube_solids([CUBE, CUBE], "5X5_50", 52, 39, "3mf")), file_type="3mf")
    assert sorted(scene.geometry) == ["cube 1 black", "cube 1 white", "cube 2 black", "cube 2 white"]
    for number in (1, 2):
        bodies = [scene.geometry[f"cube {number} {name}"] for name in ("white", "black")]
        assert all(body.is_watertight for body in bodies)
        assert sum(body.volume for body in bodies) == pytest.approx(52**3, rel=1e-6)
        cells = sum(int((tag_cells("5X5_50", tag) == 0).sum()) for tag in CUBE)
        assert bodies[1].volume == pytest.approx(cells * (39 / 7) ** 2 * INLAY, rel=0.01)


def test_the_hollows_of_an_stl_file_are_the_black_cells():
    body = trimesh.load(io.BytesIO(cube_solids([CUBE], "5X5_50", 52, 39, "stl")), file_type="stl")
    assert body.is_watertight
    centre = np.array([0, 0, 26])
    for tag, normal, up in zip(CUBE, FACE_NORMALS, FACE_UPS, strict=True):
        right = np.cross(up, normal)
        cells = tag_cells("5X5_50", tag)
        rows, columns = np.mgrid[:7, :7]
        places = (columns.ravel()[:, None] - 3) * 39 / 7 * right + (3 - rows.ravel()[:, None]) * 39 / 7 * up
        just_below = centre + places + (26 - INLAY / 2) * normal
        inside = [crossings(body.triangles, point, normal) % 2 for point in just_below]
        np.testing.assert_array_equal(np.reshape(inside, (7, 7)), cells)


def test_another_suffix_and_tags_as_large_as_the_cube_are_refused(tmp_path):
    assert check_solid_path("a.3MF") == "3mf"
    with pytest.raises(InvalidInputError, match=r"a\.obj: suffix 'obj'; expected \.3mf or \.stl"):
        check_solid_path("a.obj")
    with pytest.raises(InvalidInputError, match="tags of 51 mm on a cube of 52 mm; expected smaller tags"):
        cube_solids([CUBE], "5X5_50", 52, 51, "stl")
