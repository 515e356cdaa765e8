"""Boxes with a lid, as the world has them, and a memory of some."""

from __future__ import annotations

import numpy as np

from atg_fg.learning.shared_structure import SharedStructure
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.worlds.families import lid_boxes
from atg_fg.worlds.registry import make_world
from tests.learning.worlds import Object, trial_of

ASSUMPTIONS = make_world("lid-box").unwrapped.assumptions
#: In view are front, right wall and top; hidden the other walls and the inside. Actions are open, left and right.
LID_BOX = SharedStructure(3, ((0, 1, 5, 3, 4, 5), (4, 0, 2, 1, 3, 5), (1, 3, 2, 4, 0, 5))).canonical()
OPEN = 0
#: The hidden register that has what is inside.
INSIDE = LID_BOX.sources[OPEN][2]
BOXES = [Object(each.patterns, each.mechanism.successors[:, :, 0]) for each in lid_boxes(14, 0).objects]


def box_memory() -> StructuredMemory:
    """Fourteen boxes, each met twice in ten random actions."""
    rng = np.random.default_rng(0)
    memory = StructuredMemory(ASSUMPTIONS)
    for number in (*range(14), *range(14)):
        trial = trial_of(BOXES[number], 10, rng)
        patterns = [ASSUMPTIONS.alphabet.index(look) for look in trial.detections]
        name = memory.learn(patterns, list(trial.actions), memory.names[number] if len(memory) == 14 else None)
        memory.learn_shared(name, trial.detections, trial.actions)
    return memory


def tops_of(box: Object) -> tuple[int, int]:
    """What the top shows with the lid on and off."""
    opened = [state for state, successors in enumerate(box.successors) if successors[OPEN] == state]
    shut = next(state for state in range(len(box.patterns)) if state not in opened)
    return box.patterns[shut][2], box.patterns[opened[0]][2]
