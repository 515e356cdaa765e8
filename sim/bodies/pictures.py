"""Pictures as they are printed on boxes, drawn from a seed, and boxes that share them; and what the boxes weigh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias, get_args

import cv2
import numpy as np
from numpy.typing import NDArray

from atg_fg.core.checks import one_of, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray
from atg_fg.worlds.arcube import FACES, Cube, canonical
from atg_fg.worlds.base import probability_option

#: Side of a picture, pixels.
PICTURE_SIZE: Final = 112
#: Different pictures, and the number of a face without one.
N_PICTURES: Final = 30
PLAIN: Final = N_PICTURES
#: Share of the faces that are plain cardboard.
PLAIN_SHARE: Final = 0.25
#: Weight of most boxes, kg, and the standard deviation of its logarithm.
TYPICAL_WEIGHT: Final = 0.3
WEIGHT_SPREAD: Final = 0.5
#: What tells a box from the one that it looks like.
Difference: TypeAlias = Literal["face", "weight"]
_CARDBOARD: Final = (176, 137, 97)
_LETTERS: Final = tuple("ABCDEFGHKLMNOPRSTUVXYZ")
_MOST_DRAWS: Final = 10_000


@dataclass(frozen=True, eq=False)
class PictureBoxes:
    """Boxes of cube shape, and the pictures on them.

    Attributes:
        pictures: RGB, shape [``N_PICTURES`` + 1, size, size, 3]; the last is plain cardboard.
        faces: The picture on each face of each box, in the order of ``FACES``.
        weights: Of each box, kg, shape [n].
    """

    pictures: NDArray[np.uint8]
    faces: tuple[Cube, ...]
    weights: FloatArray


def draw_picture(rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return a label as on goods, RGB of shape [size, size, 3]: a ground, shapes and a word."""
    size = PICTURE_SIZE
    picture = np.empty((size, size, 3), dtype=np.uint8)
    picture[:] = rng.integers(40, 256, 3)
    for _ in range(int(rng.integers(2, 6))):
        colour, kind = _colour(rng), int(rng.integers(4))
        first, second = (tuple(rng.integers(5, size - 5, 2).tolist()) for _ in range(2))
        if kind == 0:
            cv2.rectangle(picture, first, second, colour, -1)
        elif kind == 1:
            cv2.circle(picture, first, int(rng.integers(8, 35)), colour, -1)
        elif kind == 2:
            cv2.line(picture, first, second, colour, int(rng.integers(4, 14)))
        else:
            cv2.fillPoly(picture, [rng.integers(0, size, (3, 2)).astype(np.int32)], colour)
    word = "".join(rng.choice(_LETTERS, int(rng.integers(2, 6))))
    place = int(rng.integers(2, 25)), int(rng.integers(40, 100))
    cv2.putText(picture, word, place, cv2.FONT_HERSHEY_SIMPLEX, float(rng.uniform(0.8, 1.4)), _colour(rng), 3)
    return picture


def make_picture_boxes(n: int, seed: int, *, look_alikes: float = 0.1, differ_in: Difference = "face") -> PictureBoxes:
    """Return boxes that share ``N_PICTURES`` pictures, no two of them the same however they are turned.

    Args:
        n: How many.
        seed: Of pictures, boxes and weights.
        look_alikes: Share of the boxes that look like an earlier one.
        differ_in: What tells these from it: a single face, or their weight alone.

    Raises:
        InvalidInputError: A number out of range, or another difference.
    """
    whole_number(n, "n_objects", 1)
    whole_number(seed, "objects_seed", 0)
    probability_option("look_alikes", look_alikes)
    one_of(differ_in, "differ_in", get_args(Difference))
    drawn = (np.random.default_rng(each) for each in np.random.SeedSequence(seed).spawn(3))
    of_pictures, of_boxes, of_weights = drawn
    cardboard = np.empty((PICTURE_SIZE, PICTURE_SIZE, 3), dtype=np.uint8)
    cardboard[:] = _CARDBOARD
    pictures = np.array([*(draw_picture(of_pictures) for _ in range(N_PICTURES)), cardboard])
    boxes: list[Cube] = []
    known: set[Cube] = set()
    for _ in range(_MOST_DRAWS + n):
        if len(boxes) == n:
            return PictureBoxes(pictures, tuple(boxes), _draw_weights(of_weights, n))
        faces = _draw_faces(of_boxes)
        if boxes and of_boxes.random() < look_alikes:
            earlier = boxes[int(of_boxes.integers(len(boxes)))]
            if differ_in == "weight":
                boxes.append(earlier)
                continue
            like, face = list(earlier), int(of_boxes.integers(len(FACES)))
            like[face] = faces[face]
            faces = (like[0], like[1], like[2], like[3], like[4], like[5])
        if canonical(faces) not in known:
            known.add(canonical(faces))
            boxes.append(faces)
    raise InvalidInputError(f"n_objects: {n}; expected fewer: found only {len(boxes)} different boxes")


def _draw_weights(rng: np.random.Generator, n: int) -> FloatArray:
    return TYPICAL_WEIGHT * np.exp(WEIGHT_SPREAD * rng.standard_normal(n))


def _draw_faces(rng: np.random.Generator) -> Cube:
    drawn = np.where(rng.random(len(FACES)) < PLAIN_SHARE, PLAIN, rng.permutation(N_PICTURES)[: len(FACES)])
    a, b, c, d, e, f = drawn.tolist()
    return a, b, c, d, e, f


def _colour(rng: np.random.Generator) -> tuple[int, int, int]:
    red, green, blue = rng.integers(0, 256, 3).tolist()
    return red, green, blue
