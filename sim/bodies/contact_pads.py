"""Where a hand without a pad touches a face: the ball that its shapes are most like, seen from where faces come."""

from __future__ import annotations

from typing import Final

import numpy as np
import pybullet

from atg_fg.core.patterns import FloatArray

#: How far faces may lean from the hand's axis, rad: as far as a yaw takes it to lean.
_LEANS: Final = (0.3, 0.6, 0.9, 1.2)
_N_TURNS: Final = 6
_REACH, _SPACING = 0.14, 0.007  # m: how far about the hand rays are shot, and how dense


def contact_pad(client: int, body: int, link: int, wrist: FloatArray, forward: FloatArray) -> tuple[FloatArray, float]:
    """Return the middle (shape [3], m) and the radius (m) of the ball that a hand's shapes are most like.

    How far a hand reaches in a direction is the support function of its shapes. That of a ball is linear in its middle
    and its radius, so the nearest ball is a least-squares fit over all directions that a face may come from.

    Args:
        client: PyBullet's physics client id.
        body: The robot.
        link: The hand.
        wrist: A point in it, shape [3], m.
        forward: Unit vector out of the hand, shape [3].

    Raises:
        ValueError: The hand has no shape that can be touched.
    """
    directions = _directions(forward)
    points = np.concatenate([_seen_from(client, body, link, wrist, direction) for direction in directions])
    if not len(points):
        raise ValueError("a hand without a shape to touch with")
    reach = ((points - wrist) @ directions.T).max(axis=0)
    *middle, radius = np.linalg.lstsq(np.column_stack([directions, np.ones(len(directions))]), reach, rcond=None)[0]
    return wrist + np.array(middle), float(radius)


def _directions(forward: FloatArray) -> FloatArray:
    """Return the unit vectors from a hand to faces before it, shape [directions, 3]."""
    across = np.linalg.svd(forward[None])[2][1:]
    turns = 2 * np.pi * np.arange(_N_TURNS) / _N_TURNS
    around = np.cos(turns)[:, None] * across[0] + np.sin(turns)[:, None] * across[1]
    return np.concatenate([forward[None], *(np.cos(lean) * forward + np.sin(lean) * around for lean in _LEANS)])


def _seen_from(client: int, body: int, link: int, wrist: FloatArray, direction: FloatArray) -> FloatArray:
    """Return the points of a link that parallel rays against a direction hit first, shape [points, 3]."""
    across = np.linalg.svd(direction[None])[2][1:]
    steps = np.arange(-_REACH, _REACH + _SPACING / 2, _SPACING)
    grid = wrist + (steps[:, None, None] * across[0] + steps[None, :, None] * across[1]).reshape(-1, 3)
    begin, end = grid + 2 * _REACH * direction, grid - _REACH * direction
    hits = pybullet.rayTestBatch(begin.tolist(), end.tolist(), physicsClientId=client)
    return np.array([hit[3] for hit in hits if hit[:2] == (body, link)]).reshape(-1, 3)
