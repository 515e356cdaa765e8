"""The 28 cm ARcube as a body in PyBullet: six square faces, each with an ArUco tag as its texture.

Frame: x points away from the robot, y to its left, z up. The robot looks along +x, so the cube's
front has the normal −x.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import cv2
import numpy as np
import pybullet
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray
from atg_fg.senses import tags
from atg_fg.worlds.arcube import FACE_NORMALS, N_TAGS, ORIENTATIONS, Cube, rotation_of

CUBE_SIZE: Final = 0.28  # m
TAG_SIZE: Final = 0.21  # m
#: Where the cube's centre stands on the table, before the robot, m.
CUBE_CENTRE: Final[FloatArray] = np.array([0.42, 0.0, 0.30])
#: 5×5 tags: the first twelve differ in at least 10 bits, those of the 4×4 dictionary in 5.
TAG_DICTIONARY: Final = "5X5_50"
#: Which way is up on the tag of each face, shape [6, 3].
FACE_UPS: Final[FloatArray] = np.array([[0, 0, 1]] * 4 + [[1, 0, 0], [-1, 0, 0]], dtype=np.float64)
_TAG_PIXELS = 84  # 12 for each of the 7 cells of a 5×5 tag with its border


def tag_image(symbol: int, pixels: int = _TAG_PIXELS) -> NDArray[np.uint8]:
    """Return the ArUco tag of a symbol in grey levels, shape [pixels, pixels]."""
    return tags.tag_image(TAG_DICTIONARY, symbol, pixels)


def face_image(symbol: int, dictionary: str = TAG_DICTIONARY) -> NDArray[np.uint8]:
    """Return a white face with a tag in the middle, RGB, 4/3 of the tag: shape [112, 112, 3] for a 5×5 tag."""
    pixels = 12 * len(tags.tag_cells(dictionary, symbol))
    margin = pixels // 6
    face = np.full((pixels + 2 * margin, pixels + 2 * margin, 3), 255, dtype=np.uint8)
    face[margin:-margin, margin:-margin] = tags.tag_image(dictionary, symbol, pixels)[:, :, None]
    return face


#: Of every orientation, shape [24, 3, 3].
_ALL_ROTATIONS: Final[FloatArray] = np.array([rotation_of(orientation) for orientation in range(len(ORIENTATIONS))])


def quaternion_of(rotation: FloatArray) -> tuple[float, float, float, float]:
    """Return the quaternion (x, y, z, w) of a rotation matrix."""
    vector = cv2.Rodrigues(rotation)[0].ravel()
    angle = float(np.linalg.norm(vector))
    if angle < 1e-12:
        return (0.0, 0.0, 0.0, 1.0)
    x, y, z = np.sin(angle / 2) * vector / angle
    return (float(x), float(y), float(z), float(np.cos(angle / 2)))


class CubeBody:
    """One cube in a PyBullet client; its tags can be changed to those of another cube.

    Textures are loaded once a client, since PyBullet never frees one: further cubes take those of the first.

    Args:
        client: PyBullet's physics client id.
        mass: Kilograms; a cube without one is a picture that nothing moves or touches.
        like: Another cube in the same client, whose textures to take.
        faces: What the faces may show, RGB, if not the tags 0 to 11 in their order.
    """

    def __init__(
        self,
        client: int,
        mass: float = 0.0,
        like: CubeBody | None = None,
        faces: Sequence[NDArray[np.uint8]] | None = None,
    ) -> None:
        self.client = client
        # PyBullet reads meshes and textures when they are created; the files are not needed afterwards.
        with tempfile.TemporaryDirectory(prefix="arcube-") as folder:
            self._textures: list[int] = (
                like._textures if like else _load_textures(client, faces or _tagged_faces(), Path(folder))
            )
            meshes = [_write_face(face, Path(folder)) for face in range(len(FACE_NORMALS))]
            shape = pybullet.createVisualShapeArray(
                shapeTypes=[pybullet.GEOM_MESH] * len(meshes),
                fileNames=meshes,
                rgbaColors=[[1, 1, 1, 1]] * len(meshes),
                visualFramePositions=[[0, 0, 0]] * len(meshes),
                meshScales=[[1, 1, 1]] * len(meshes),
                physicsClientId=client,
            )
            solid = _solid_box(client) if mass else -1
            self.body = int(pybullet.createMultiBody(mass, solid, shape, physicsClientId=client))

    def show(self, cube: Cube) -> None:
        """Put the tags of ``cube`` on the faces."""
        for face, symbol in enumerate(cube):
            pybullet.changeVisualShape(
                self.body,
                -1,
                shapeIndex=face,
                textureUniqueId=self._textures[symbol],
                specularColor=[0, 0, 0],
                physicsClientId=self.client,
            )

    def pose(self) -> tuple[FloatArray, FloatArray]:
        """Return the true position of the cube's centre, shape [3], m, and its rotation, shape [3, 3]."""
        position, quaternion = pybullet.getBasePositionAndOrientation(self.body, physicsClientId=self.client)
        rotation = np.array(pybullet.getMatrixFromQuaternion(quaternion)).reshape(3, 3)
        return np.array(position), rotation

    def place(self, position: FloatArray, rotation: FloatArray) -> None:
        """Put the cube's centre at ``position`` (m), turned by a rotation matrix."""
        pybullet.resetBasePositionAndOrientation(
            self.body, position.tolist(), quaternion_of(rotation), physicsClientId=self.client
        )


def _tagged_faces() -> list[NDArray[np.uint8]]:
    return [face_image(symbol) for symbol in range(N_TAGS)]


def _load_textures(client: int, faces: Sequence[NDArray[np.uint8]], folder: Path) -> list[int]:
    textures = []
    for number, face in enumerate(faces):
        path = folder / f"face{number}.png"
        cv2.imwrite(str(path), cv2.cvtColor(face, cv2.COLOR_RGB2BGR))
        textures.append(int(pybullet.loadTexture(str(path), physicsClientId=client)))
    return textures


def _solid_box(client: int) -> int:
    return int(
        pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[CUBE_SIZE / 2] * 3, physicsClientId=client)
    )


def nearest_orientation(rotation: FloatArray) -> tuple[int, float]:
    """Return which of the 24 orientations a rotation matrix is nearest to, and how far it is from it, rad."""
    traces = np.einsum("oij,ij->o", _ALL_ROTATIONS, rotation)
    nearest = int(traces.argmax())
    return nearest, float(np.arccos(np.clip((traces[nearest] - 1) / 2, -1, 1)))


def face_corners(face: int, rotation: FloatArray, centre: FloatArray) -> FloatArray:
    """Return the corners of a face, clockwise from the upper left one of its picture, shape [4, 3], m."""
    normal, up = FACE_NORMALS[face], FACE_UPS[face]
    right = np.cross(up, normal)
    half = CUBE_SIZE / 2
    own = half * (normal + np.array([up - right, up + right, right - up, -up - right]))
    return np.asarray(own @ rotation.T + centre)


def _write_face(face: int, folder: Path) -> str:
    """Write one face as a textured square in Wavefront OBJ and return its path."""
    normal, up = FACE_NORMALS[face], FACE_UPS[face]
    right = np.cross(up, normal)
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    lines = ["v {:.6f} {:.6f} {:.6f}".format(*CUBE_SIZE / 2 * (normal + x * right + y * up)) for x, y in corners]
    lines += [f"vt {(x + 1) // 2} {(y + 1) // 2}" for x, y in corners]
    lines += ["vn {:.0f} {:.0f} {:.0f}".format(*normal)] * 4
    lines += ["f 1/1/1 2/2/2 3/3/3", "f 1/1/1 3/3/3 4/4/4"]
    path = folder / f"face{face}.obj"
    path.write_text("\n".join(lines) + "\n")
    return str(path)
