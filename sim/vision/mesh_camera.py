"""A camera that sees one thing of any shape on a table, and cuts it out by what differs from the empty table."""

from __future__ import annotations

import weakref
from typing import Final

import cv2
import numpy as np
import pybullet
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray
from atg_fg.senses.face_features import VIEW, check_image
from sim.bodies.cube import CUBE_CENTRE, quaternion_of
from sim.bodies.meshes import Mesh
from sim.bodies.tables import TABLE_TOP, WOOD
from sim.vision.box_pose import lightness, turned
from sim.vision.camera import Camera, Light
from sim.vision.image_noise import in_usual_light
from sim.vision.object_camera import ObjectCamera

_GREY: Final = (0.55, 0.55, 0.60, 1.0)
#: What differs from the empty table by more, in the three colours together, is the thing; grey levels.
_DIFFERENCE: Final = 60.0
_LEAST_PART: Final = 0.004  # of the image
#: Side of what is cut out, as a share of the image's height: the largest thing with its jitter.
_SIDE: Final = 0.85


class MeshCamera(ObjectCamera):
    """Renders a thing alone and lays it over a picture of the table, as light as the lamp is at this look.

    Args:
        camera: Where it stands.
        jitter: As for ``ObjectCamera``.
    """

    def __init__(self, camera: Camera, **jitter: float) -> None:
        super().__init__(camera, **jitter)
        self._client = pybullet.connect(pybullet.DIRECT)
        # A camera that nobody closes must not keep its client until the process ends.
        self._disconnect = weakref.finalize(self, pybullet.disconnect, physicsClientId=self._client)
        self._shown: Mesh | None = None
        self._body = -1
        width, height = camera.image_size
        wood = 255.0 * np.array(WOOD[:3], dtype=np.float32) * np.float32(Light().on_top)
        # The table is wider than the image.
        self.empty = np.tile(wood, (height, width, 1))

    def close(self) -> None:
        """Leave PyBullet; the camera cannot be used any more."""
        self._disconnect()

    def _show(self, mesh: Mesh) -> None:
        if mesh is self._shown:
            return
        if self._body >= 0:
            pybullet.removeBody(self._body, physicsClientId=self._client)
        shape = pybullet.createVisualShape(
            pybullet.GEOM_MESH,
            fileName=str(mesh.path),
            meshScale=[mesh.scale] * 3,
            visualFramePosition=(-mesh.middle * mesh.scale).tolist(),
            rgbaColor=_GREY,
            physicsClientId=self._client,
        )
        self._body = int(pybullet.createMultiBody(0, -1, shape, physicsClientId=self._client))
        self._shown = mesh

    def frame(self, mesh: Mesh, rotation: FloatArray, rng: np.random.Generator) -> NDArray[np.uint8]:
        """Return what the camera sees, RGB, shape [height, width, 3].

        Args:
            mesh: The thing.
            rotation: In which it stands on the table, shape [3, 3].
            rng: Of pose, light and noise.
        """
        self._show(mesh)
        turn = turned(float(np.radians(rng.uniform(-1, 1) * self.yaw_jitter))) @ rotation
        position = CUBE_CENTRE + np.append(rng.uniform(-1, 1, 2) * self.position_jitter, 0.0)
        position[2] = TABLE_TOP - float((mesh.vertices @ turn.T)[:, 2].min())
        pybullet.resetBasePositionAndOrientation(
            self._body, position.tolist(), quaternion_of(turn), physicsClientId=self._client
        )
        light = self.imaging.light(rng)
        seen, depth = self.camera.render_with_depth(self._client, light)
        table = self.empty * np.float32((light.ambient + light.diffuse) / (Light().ambient + Light().diffuse))
        frame = np.clip(np.where((depth > 0)[..., None], seen, table), 0, 255).astype(np.uint8)
        return self.imaging.developed(frame, rng)

    def view(self, frame: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return a square about what differs from the empty table, in usual light, shape [side, side, 3].

        It is about the middle of the image if nothing does.

        Raises:
            InvalidInputError: A frame of another size or type.
        """
        check_image(frame, "frame", self.camera.image_size)
        usual = in_usual_light(frame, lightness(frame, self.empty))
        side = round(_SIDE * frame.shape[0])
        across, down = self._middle(usual)
        moved = np.array([[1.0, 0.0, side / 2 - across], [0.0, 1.0, side / 2 - down]])
        square = cv2.warpAffine(usual, moved, (side, side), borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(cv2.resize(square, (VIEW, VIEW), interpolation=cv2.INTER_AREA), dtype=np.uint8)

    def _middle(self, usual: NDArray[np.uint8]) -> tuple[float, float]:
        """Return the middle of the bounding box of what is no table, pixels."""
        seen = cv2.GaussianBlur(usual, (0, 0), 1.0).astype(np.float32)
        differs = (np.abs(seen - self.empty).sum(axis=2) > _DIFFERENCE).astype(np.uint8)
        differs = np.asarray(cv2.morphologyEx(differs, cv2.MORPH_OPEN, np.ones((3, 3), dtype=np.uint8)))
        n_parts, parts, sizes, _ = cv2.connectedComponentsWithStats(differs)
        large = [part for part in range(1, n_parts) if sizes[part, cv2.CC_STAT_AREA] > _LEAST_PART * differs.size]
        if not large:
            return usual.shape[1] / 2, usual.shape[0] / 2
        down, across = np.nonzero(np.isin(parts, large))
        return float(across.min() + across.max()) / 2, float(down.min() + down.max()) / 2
