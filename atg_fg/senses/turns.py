"""Notices from the poses of tags that a cube was put down, how it was turned, and that it was taken away."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray
from atg_fg.senses.tags import DetectedTag
from atg_fg.senses.viewpoint import USUAL_PITCH, Viewpoint

#: The 24 rotations of a cube, shape [24, 3, 3].
CUBE_ROTATIONS: Final[FloatArray] = np.array(
    [
        matrix
        for places in itertools.permutations(range(3))
        for signs in itertools.product((1.0, -1.0), repeat=3)
        if np.linalg.det(matrix := np.diag(signs)[list(places)]) > 0
    ]
)

#: Error of a pose over that of the other one that shows a tag alike, up to which the other one is out of question.
_CLEAR: Final = 0.3
#: What speaks against the other pose if its error is far larger; it has to be so many degrees straighter.
_UNLIKELY: Final = 60.0
#: How straight tags are on the faces of a cube, as far as can be measured, degrees.
_GLUED: Final = 15.0


def nearest_rotation(rotation: FloatArray) -> tuple[float, int]:
    """Return how far a rotation matrix is from the nearest of ``CUBE_ROTATIONS``, degrees, and which that is."""
    traces = np.einsum("oij,ij->o", CUBE_ROTATIONS, rotation)
    nearest = int(traces.argmax())
    return math.degrees(math.acos(np.clip((traces[nearest] - 1) / 2, -1, 1))), nearest


@dataclass(frozen=True, eq=False)
class CubeAtRest:
    """A cube that stands still, seen.

    Attributes:
        slots: The tag in front and the tag on top, ``None`` where none is seen.
        turn: The actions that turned it since it stood last, in order; none at its first rest, and where it stands as
            it stood but shows a tag that was hidden then; ``None`` if it was turned but it is not known how.
    """

    slots: Mapping[str, DetectedTag | None]
    turn: tuple[str, ...] | None


class CubeTakenAway:
    """The cube has left the picture."""


@dataclass(frozen=True)
class Patience:
    """How long things take before they count, s, and how far they may be off.

    Attributes:
        rest: A cube that has not moved for this long is at rest.
        hidden: At rest with a face hidden, as by a hand, it is looked at after this long all the same.
        absent: A cube not seen for this long has been taken away.
        still: How far corners of a tag may move from frame to frame, as a share of its side.
        skew: How far a cube at rest may be turned off straight, degrees.
    """

    rest: float = 0.35
    hidden: float = 1.5
    absent: float = 2.0
    still: float = 0.03
    skew: float = 32.0

    @classmethod
    def of_pictures(cls) -> Patience:
        """Return the patience for single pictures: each shows a cube at rest, and one without tags that it is gone."""
        return cls(rest=0.0, hidden=0.0, absent=0.0, still=math.inf)


class TurnWatcher:
    """Watches the tags in frame after frame.

    Which tag is where on the cube is noticed while it is turned, so any tag that was seen before tells how it stands.

    Args:
        actions: Rotation by each action in the table's frame (x away from the camera, y left, z up), shape [3, 3].
        viewpoint: How the camera looks at the table; found out from the first cube that shows two faces if not given.
        patience: How long things take.

    Attributes:
        actions: Names of the actions.
        viewpoint: How the camera looks at the table, as far as is known.
    """

    def __init__(
        self, actions: Mapping[str, FloatArray], viewpoint: Viewpoint | None = None, patience: Patience | None = None
    ) -> None:
        self.patience = patience or Patience()
        self.viewpoint = viewpoint or Viewpoint.pitched(USUAL_PITCH)
        self._viewpoint_is_guessed = viewpoint is None
        self.actions = tuple(actions)
        self._sequences = _shortest_sequences(actions)
        self.forget_cube()

    def forget_cube(self) -> None:
        """Take what is seen next for another cube."""
        self._before: Sequence[DetectedTag] = ()
        self._still_since = math.inf
        self._last_seen: float | None = None
        self._on_cube: dict[int, FloatArray] = {}
        self._turned: FloatArray | None = None
        self._stood: int | None = None
        self._reported = False
        self._hidden: set[str] = set()  # slots in which nothing was seen as it stands

    def take(self, time: float, tags: Sequence[DetectedTag]) -> CubeAtRest | CubeTakenAway | None:
        """Take in the tags of a frame; say what has happened, if anything has.

        Args:
            time: Of the frame, s.
            tags: With poses; tags that do not count are left out, and an id that is seen twice is not believed.

        Raises:
            InvalidInputError: A tag without a pose.
        """
        ids = [tag.id for tag in tags]
        believed = [tag for tag in tags if tag.symbol is not None and ids.count(tag.id) == 1]
        if any(tag.pose is None for tag in believed):
            raise InvalidInputError("tags without poses; expected the intrinsics of the camera")
        if not believed:
            return self._not_seen(time)
        self._last_seen = time
        moved = self._has_moved(believed)
        self._before = believed
        if moved:
            self._still_since, self._reported = time, False
        self._note_places(believed)
        return None if self._reported and not self._hidden else self._at_rest(time, believed)

    def _not_seen(self, time: float) -> CubeTakenAway | None:
        self._before = ()
        if self._last_seen is None or time - self._last_seen < self.patience.absent:
            return None
        self.forget_cube()
        return CubeTakenAway()

    def _has_moved(self, tags: Sequence[DetectedTag]) -> bool:
        before = {tag.id: tag for tag in self._before}
        both = [(before[tag.id], tag) for tag in tags if tag.id in before]
        if not both:
            return True
        most = max(float(np.abs(old.corners - new.corners).mean() / new.side) for old, new in both)
        return most > self.patience.still or not math.isfinite(self.patience.still)

    def _at_rest(self, time: float, tags: Sequence[DetectedTag]) -> CubeAtRest | None:
        """Return the cube if it stands straight and has stood still for long enough."""
        since = time - self._still_since
        if since < self.patience.rest:
            return None
        if self._viewpoint_is_guessed and (found := Viewpoint.of_tags(tags)) is not None:
            self.viewpoint, self._viewpoint_is_guessed = found, False
        tags = [self._straightened(tag) for tag in tags]
        slots = self.viewpoint.slots(tags)
        if None in slots.values() and since < self.patience.hidden:
            return None
        self._note_places(tags, stands=True)
        stands = self._standing(tags)
        is_strange = not any(tag.id in self._on_cube for tag in tags)
        if is_strange and any(tag is not None for tag in slots.values()):
            # None of its tags was seen before: it was turned unseen, or it is another cube.
            self._on_cube = {}
            self._note_places(tags)
            self._reported, self._stood, self._hidden = True, self._standing(tags), _empty(slots)
            return CubeAtRest(slots, None)
        if stands is None or all(tag is None for tag in slots.values()):
            return None
        turn: tuple[str, ...] | None = ()
        if self._stood is not None:
            turn = self._sequences.get(_composed(stands, self._stood))
        hidden = self._hidden & _empty(slots) if self._stood is not None and turn == () else None
        shows_nothing_new = hidden == self._hidden
        self._reported, self._stood, self._hidden = True, stands, _empty(slots) if hidden is None else hidden
        return None if shows_nothing_new else CubeAtRest(slots, turn)

    def _straightened(self, tag: DetectedTag) -> DetectedTag:
        """Return the tag in that of its poses, if both are likely, in which it faces straight to a side or up."""
        if _ambiguity(tag) < _CLEAR:
            return tag
        axes = self.viewpoint.axes
        straightest, _ = min(_rotations(tag), key=lambda each: nearest_rotation(axes @ each[0])[0] + each[1])
        assert tag.pose is not None
        return replace(tag, pose=replace(tag.pose, rotation=straightest))

    def _note_places(self, tags: Sequence[DetectedTag], *, stands: bool = False) -> None:
        """Note how tags that are seen for the first time sit on the cube, by those that are known.

        While the cube is being turned, only what is seen clearly counts; when it stands, the table tells poses apart.
        """
        if not self._on_cube:
            self._on_cube[min(tags, key=_ambiguity).id] = np.eye(3)
        known = [tag for tag in tags if tag.id in self._on_cube]
        cube = self._cube_rotation(tags, stands=stands)
        if cube is None or not (stands or min(map(_ambiguity, known)) < _CLEAR):
            return
        for tag in tags:
            if tag.id not in self._on_cube and (stands or _ambiguity(tag) < _CLEAR):
                # Of the two poses that show the tag alike, that in which it sits straight on the cube.
                (off, place), *others = sorted(nearest_rotation(cube.T @ rotation) for rotation, _ in _rotations(tag))
                if off < _GLUED and all(place == other or apart > 2 * off for apart, other in others):
                    self._on_cube[tag.id] = CUBE_ROTATIONS[place]

    def _cube_rotation(self, tags: Sequence[DetectedTag], *, stands: bool = False) -> FloatArray | None:
        """Return the rotation from the cube's frame, that of the tag seen first, to the camera's.

        Of the poses that each tag allows, those are taken that agree best: with each other, with the table if the cube
        stands on it, or else with how it was turned a moment ago.
        """
        known = sorted((tag for tag in tags if tag.id in self._on_cube), key=_ambiguity)
        if not known:
            return None
        allowed = [[(rotation @ self._on_cube[tag.id].T, cost) for rotation, cost in _rotations(tag)] for tag in known]

        def disagreement(cube: FloatArray) -> float:
            total = sum(min(_angle(cube, each) + cost for each, cost in rotations) for rotations in allowed)
            if stands:
                total += nearest_rotation(self.viewpoint.axes @ cube)[0]
            elif self._turned is not None and len(known) == 1 and _ambiguity(known[0]) > _CLEAR:
                total += _angle(cube, self._turned)
            return total

        self._turned = min((cube for rotations in allowed for cube, _ in rotations), key=disagreement)
        return self._turned

    def _standing(self, tags: Sequence[DetectedTag]) -> int | None:
        """Return which of the 24 rotations the cube stands in on the table, ``None`` if it is aslant or unknown."""
        cube = self._cube_rotation(tags, stands=True)
        if cube is None:
            return None
        off, stands = nearest_rotation(self.viewpoint.axes @ cube)
        return stands if off < self.patience.skew else None


def _empty(slots: Mapping[str, DetectedTag | None]) -> set[str]:
    return {slot for slot, tag in slots.items() if tag is None}


def _ambiguity(tag: DetectedTag) -> float:
    return 1.0 if tag.pose is None else tag.pose.ambiguity


def _rotations(tag: DetectedTag) -> list[tuple[FloatArray, float]]:
    """Return the rotations of a tag that show it much alike, each with what speaks against it, in degrees."""
    assert tag.pose is not None
    likelier = [(tag.pose.rotation, 0.0)]
    if tag.pose.other_rotation is None:
        return likelier
    return [*likelier, (tag.pose.other_rotation, _UNLIKELY * (1 - tag.pose.ambiguity))]


def _angle(one: FloatArray, other: FloatArray) -> float:
    """Return the angle between two rotations, degrees."""
    return math.degrees(math.acos(np.clip(((one * other).sum() - 1) / 2, -1, 1)))


def _composed(after: int, before: int) -> int:
    """Return the rotation that leads from one of the 24 to another."""
    return nearest_rotation(CUBE_ROTATIONS[after] @ CUBE_ROTATIONS[before].T)[1]


def _shortest_sequences(actions: Mapping[str, FloatArray]) -> dict[int, tuple[str, ...]]:
    """Return the fewest actions that turn a cube by each of the rotations that they can reach."""
    upright = nearest_rotation(np.eye(3))[1]
    sequences: dict[int, tuple[str, ...]] = {upright: ()}
    reached = [upright]
    for number in reached:  # grows while it is walked: breadth first
        for name, rotation in actions.items():
            turned = nearest_rotation(rotation @ CUBE_ROTATIONS[number])[1]
            if turned not in sequences:
                sequences[turned] = (*sequences[number], name)
                reached.append(turned)
    return sequences
