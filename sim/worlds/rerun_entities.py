"""What is in a PyBullet client as entities of a Rerun recording: bodies, the tags of cubes, a camera.

Rerun is imported by what is called here, not with the module; who has a recording has it.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
import pybullet
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray
from atg_fg.display.rerun_viewer import import_rerun
from atg_fg.worlds.arcube import FACE_NORMALS, Cube
from sim.bodies.cube import CUBE_SIZE, FACE_UPS, face_image, quaternion_of
from sim.vision.camera import Camera

#: Triangles of a square whose corners go round.
_SQUARE: Final = [[0, 1, 2], [0, 2, 3]]
_CORNERS: Final = ((-1, -1), (1, -1), (1, 1), (-1, 1))
_IMAGE_PLANE: Final = 0.12  # m before the camera, where its picture is shown


def log_world(recording: Any) -> None:
    """Say which way is up."""
    recording.log("world", import_rerun().ViewCoordinates.RIGHT_HAND_Z_UP, static=True)


def log_cube(recording: Any, path: str, cube: Cube, pictures: Sequence[NDArray[np.uint8]] | None = None) -> None:
    """Log a cube's six faces with their tags, or the pictures of their symbols, about its centre."""
    rerun = import_rerun()
    for face, symbol in enumerate(cube):
        normal, up = FACE_NORMALS[face], FACE_UPS[face]
        right = np.cross(up, normal)
        corners = [CUBE_SIZE / 2 * (normal + x * right + y * up) for x, y in _CORNERS]
        mesh = rerun.Mesh3D(
            vertex_positions=corners,
            triangle_indices=_SQUARE,
            vertex_normals=[normal] * 4,
            # A texture's rows go down.
            vertex_texcoords=[((1 + x) / 2, (1 - y) / 2) for x, y in _CORNERS],
            albedo_texture=face_image(symbol) if pictures is None else pictures[symbol],
        )
        recording.log(f"{path}/face_{face}", mesh)


def log_pose(recording: Any, path: str, position: FloatArray, rotation: FloatArray) -> None:
    """Log where something is: its position, shape [3], m, and rotation matrix."""
    rerun = import_rerun()
    pose = rerun.Transform3D(translation=position, quaternion=rerun.Quaternion(xyzw=quaternion_of(rotation)))
    recording.log(path, pose)


def log_camera(recording: Any, camera: Camera, picture: NDArray[np.uint8]) -> None:
    """Log a camera where it stands, and what it sees with the detections drawn, RGB, shape [height, width, 3]."""
    rerun = import_rerun()
    log_pose(recording, "world/camera", np.asarray(camera.eye), camera.rotation)
    lens = rerun.Pinhole(
        image_from_camera=camera.intrinsics, resolution=camera.image_size, image_plane_distance=_IMAGE_PLANE
    )
    recording.log("world/camera", lens)
    recording.log("world/camera", rerun.Image(picture).compress(jpeg_quality=90))


def log_shapes(recording: Any, path: str, client: int, body: int, meshes: Path | None = None) -> None:
    """Log what a body looks like, each shape below the link it belongs to; where the links are says ``log_links``.

    Args:
        recording: Rerun's ``RecordingStream``.
        path: Of the body's entity.
        client: PyBullet's physics client id.
        body: The body.
        meshes: Folder to look for mesh files in that are no more where the body was loaded from.
    """
    rerun = import_rerun()
    for number, shape in enumerate(pybullet.getVisualShapeData(body, physicsClientId=client)):
        _, link, kind, size, file, position, quaternion, colour = shape[:8]
        entity = f"{path}/{link_name(client, body, link)}/shape_{number}"
        place = {"translation": position, "quaternion": rerun.Quaternion(xyzw=quaternion)}
        if kind == pybullet.GEOM_BOX:
            recording.log(entity, rerun.Transform3D(**place), static=True)
            recording.log(entity, rerun.Boxes3D(sizes=[size], colors=[colour], fill_mode="solid"), static=True)
        elif kind == pybullet.GEOM_MESH and (mesh := _mesh_file(file.decode(), meshes)) is not None:
            recording.log(entity, rerun.Transform3D(**place, scale=size), static=True)
            recording.log(entity, rerun.Asset3D(path=mesh, albedo_factor=colour), static=True)


def log_links(recording: Any, path: str, client: int, body: int) -> None:
    """Log where a body's links are in the world."""
    rerun = import_rerun()
    for link in range(-1, pybullet.getNumJoints(body, physicsClientId=client)):
        position, quaternion = _link_pose(client, body, link)
        pose = rerun.Transform3D(translation=position, quaternion=rerun.Quaternion(xyzw=quaternion))
        recording.log(f"{path}/{link_name(client, body, link)}", pose)


def link_name(client: int, body: int, link: int) -> str:
    """Return the name of a link; −1 is the base."""
    if link < 0:
        return str(pybullet.getBodyInfo(body, physicsClientId=client)[0].decode() or "base")
    # A slash would make an entity below another one.
    return str(pybullet.getJointInfo(body, link, physicsClientId=client)[12].decode()).replace("/", ".")


def _link_pose(client: int, body: int, link: int) -> tuple[Any, Any]:
    """Return position and quaternion of a link's frame in the world."""
    if link >= 0:
        state = pybullet.getLinkState(body, link, computeForwardKinematics=1, physicsClientId=client)
        return state[4], state[5]
    # PyBullet says where the base's centre of mass is; shapes are placed in the link's frame.
    mass_position, mass_quaternion = pybullet.getBasePositionAndOrientation(body, physicsClientId=client)
    info = pybullet.getDynamicsInfo(body, -1, physicsClientId=client)
    return pybullet.multiplyTransforms(  # type: ignore[no-any-return]
        mass_position, mass_quaternion, *pybullet.invertTransform(info[3], info[4])
    )


def _mesh_file(name: str, meshes: Path | None) -> Path | None:
    """Return where a mesh is, ``None`` if it is gone."""
    candidates = [Path(name), *([meshes / Path(name).name] if meshes is not None else [])]
    return next((path for path in candidates if os.path.isfile(path)), None)
