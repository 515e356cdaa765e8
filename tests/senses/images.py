"""Pictures of tags whose truth is known: drawn flat, or seen by a camera of a known pose."""

from functools import cache

import cv2
import numpy as np

from atg_fg.senses.tags import tag_image

INTRINSICS = np.array([[600.0, 0, 320], [0, 600, 240], [0, 0, 1]])


def sheet(dictionary, ids, side=90, columns=4):
    """Tags in rows on white, RGB."""
    rows = -(-len(ids) // columns)
    step = side + 40
    page = np.full((rows * step + 40, columns * step + 40), 255, dtype=np.uint8)
    for place, tag_id in enumerate(ids):
        row, column = divmod(place, columns)
        y, x = 40 + row * step, 40 + column * step
        page[y : y + side, x : x + side] = tag_image(dictionary, tag_id, side)
    return np.repeat(page[:, :, None], 3, axis=2)


def turned(axis, degrees):
    return cv2.Rodrigues(np.radians(degrees) * np.array(axis, dtype=float))[0]


#: From a tag that faces the camera (x right, y up, z towards it) to the camera's frame.
FACING = np.diag([1.0, -1.0, -1.0])


@cache
def looks_along(shape, distortion=None):
    """The direction that each pixel looks along, shape [height, width, 3]."""
    y, x = np.mgrid[: shape[0], : shape[1]].astype(np.float64)
    pixels = np.stack([x.ravel(), y.ravel()], axis=1)[:, None]
    rays = cv2.undistortPoints(pixels, INTRINSICS, None if distortion is None else np.array(distortion)).reshape(-1, 2)
    return np.column_stack([rays, np.ones(len(rays))]).reshape(*shape, 3)


def seen(dictionary, tag_id, rotation, position, size=0.05, shape=(480, 640), distortion=None):
    """A tag of ``size`` metres at a pose in the camera's frame, on white, RGB."""
    directions = looks_along(shape, None if distortion is None else tuple(np.ravel(distortion).tolist()))
    grey = looked_at(dictionary, tag_id, rotation, position, size, directions)
    return np.repeat(grey[:, :, None], 3, axis=2)


def looked_at(dictionary, tag_id, rotation, position, size, directions):
    """A part of such a picture, grey: each pixel is asked what it looks at."""
    side = 400
    flat = np.full((side * 3 // 2, side * 3 // 2), 255, dtype=np.uint8)
    margin = side // 4
    flat[margin : margin + side, margin : margin + side] = tag_image(dictionary, tag_id, side)
    normal = rotation[:, 2]
    distance = (normal @ position) / (directions @ normal)
    on_plane = (directions * distance[..., None] - position) @ rotation[:, :2]
    column = (on_plane[..., 0] / size + 0.75) * side - 0.5
    row = (0.75 - on_plane[..., 1] / size) * side - 0.5
    maps = [part.astype(np.float32) for part in (column, row)]
    return cv2.remap(flat, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=255)


def cube_picture(faces, cube, dictionary="5X5_50", pitch=40.0, shape=(480, 640), tag_size=0.042, side=0.056):
    """A cube on a table, RGB: ids on its faces (front, back, left, right, top, bottom) and its rotation on the table.

    The camera looks down by ``pitch`` degrees from 30 cm away.
    """
    from atg_fg.senses.viewpoint import Viewpoint
    from atg_fg.worlds.arcube import FACE_NORMALS

    ups = np.array([[0, 0, 1]] * 4 + [[1, 0, 0], [-1, 0, 0]], dtype=float)
    from_table = Viewpoint.pitched(pitch).axes.T
    picture = np.full((*shape, 3), 120, dtype=np.uint8)
    for tag_id, normal, up in zip(faces, FACE_NORMALS, ups, strict=True):
        rotation = from_table @ cube @ np.column_stack([np.cross(up, normal), up, normal])
        position = np.array([0, 0, 0.3]) + side / 2 * rotation[:, 2]
        if rotation[:, 2] @ position < -0.02:
            square = side / 2 * np.array([[-1, 1, 0], [1, 1, 0], [1, -1, 0], [-1, -1, 0]])
            corners = (square @ rotation.T + position) @ INTRINSICS.T
            outline = np.round(corners[:, :2] / corners[:, 2:]).astype(np.int32)
            inside = cv2.fillConvexPoly(np.zeros(shape, dtype=np.uint8), outline, 1).astype(bool)
            left, top, width, height = cv2.boundingRect(outline)
            around = np.s_[max(top, 0) : top + height, max(left, 0) : left + width]
            directions = looks_along(shape)[around]
            grey = looked_at(dictionary, tag_id, rotation, position, tag_size, directions)
            picture[around][inside[around]] = grey[inside[around], None]
    return picture
