"""What a memory learns from what an engine has gone through: looks at rest as one, actions only where they are sure."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from typing import NamedTuple

from atg_fg.core.actions import NOTHING, UncertainAction
from atg_fg.core.looks import likely_pattern, strength
from atg_fg.core.memory import RobotMemory
from atg_fg.core.open_alphabets import Relabelling
from atg_fg.core.patterns import Evidence
from atg_fg.inference.history import History
from atg_fg.inference.interface import Inference


class _Rest(NamedTuple):
    """Looks without an action between them, and the action after them, ``None`` at the end or if it is not sure."""

    looks: list[Evidence]
    action: int | None

    @property
    def pattern(self) -> int | None:
        """The first pattern that was seen whole, or that the strongest look makes more probable than not."""
        whole = next((look.pattern for look in self.looks if look.pattern is not None), None)
        return likely_pattern(self.strongest) if whole is None else whole

    @property
    def strongest(self) -> Evidence:
        """The look that says most."""
        return max(self.looks, key=strength)


def learn_history(
    memory: RobotMemory, trial: Inference, matched: str | None, name: str | None = None, *, taught: bool = False
) -> str | None:
    """Let a memory learn from a trial, in one transaction if it is kept in a file; return the name of the ATG.

    Args:
        memory: What learns; labels that it did not know when the trial began are added to its open alphabet.
        trial: What was seen and done.
        matched: Name of the ATG that the object is of, ``None`` if it is new.
        name: Of the ATG of a new object; the next number if not given.
        taught: Whether someone said of which object the trial is.

    Returns:
        ``None`` if no pattern was seen whole or made more probable than not, so that nothing was learned.
    """
    if all(likely_pattern(look) is None for look in trial.history.evidence):
        return None
    alphabet = trial.memory.assumptions.alphabet
    with memory.transaction():
        memory.extend(alphabet.names)
        rests = list(_rests(trial.history, Relabelling(alphabet, memory.assumptions.alphabet)))
        patterns = [rest.pattern for rest in rests]
        measured = [look.measured for look in trial.history.evidence]
        learned = memory.learn(patterns, [rest.action for rest in rests[:-1]], matched, name, measured)
        for piece in _pieces(rests):
            looks = [rest.strongest for rest in piece]
            detections = [look.detection or (None,) * len(memory.assumptions.alphabet.slots) for look in looks]
            actions = [rest.action for rest in piece[:-1] if rest.action is not None]
            confidences = [look.confidences for look in looks] if any(look.confidences for look in looks) else []
            likelihoods = [look.slots for look in looks] if any(look.slots for look in looks) else []
            felt = [tuple(itertools.chain.from_iterable(look.measured for look in rest.looks)) for rest in piece]
            learned = memory.learn_shared(learned, detections, actions, confidences, likelihoods, felt, taught=taught)
    return learned


def _rests(history: History, labels: Relabelling) -> Iterator[_Rest]:
    """Yield the looks of each aspect, under the new labels."""
    looks: list[Evidence] = []
    for time, look in enumerate(history.evidence):
        looks.append(look if labels.new == labels.old else labels.evidence(look))
        action = history.actions[time] if time + 1 < len(history.evidence) else None
        if action != NOTHING:
            yield _Rest(looks, None if isinstance(action, UncertainAction) else action)
            looks = []


def _pieces(rests: list[_Rest]) -> Iterator[list[_Rest]]:
    """Yield the parts of a trial between which it is not sure what was done: each is a raw trial of the object."""
    piece: list[_Rest] = []
    for rest in rests:
        piece.append(rest)
        if rest.action is None:
            yield piece
            piece = []
