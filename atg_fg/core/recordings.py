"""What a user's own detector saw and what their robot did, trial by trial, in the words of the recording."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.checks import listed
from atg_fg.core.errors import InvalidInputError, placed
from atg_fg.core.object_sense import ObjectSense, check_measured
from atg_fg.core.patterns import Evidence, Measured, PatternAlphabet

#: Aspects of an object, if nothing is said of their number and there are more patterns than that.
USUAL_ASPECTS = 24


class RecordedLook(NamedTuple):
    """One look.

    Attributes:
        labels: The label in each slot, ``None`` where nothing was seen, or where there are weights.
        confidences: Of each label; ``None`` where the detector does not say.
        weights: Likelihood of each label in each slot, by label; ``None`` of a slot without.
        measured: Readings of the object as a whole, such as its weight.
    """

    labels: tuple[str | None, ...]
    confidences: tuple[float | None, ...] = ()
    weights: tuple[Mapping[str, float] | None, ...] = ()
    measured: Measured = ()

    def evidence(self, assumptions: Assumptions) -> Evidence:
        """Return the look as evidence.

        Raises:
            InvalidInputError: A label that is none of the alphabet's, or that repeats where labels exclude each other;
                or a reading that is none of a sense.
        """
        alphabet, measured = assumptions.alphabet, check_measured(assumptions.object_senses, dict(self.measured))
        stated = self.confidences if any(value is not None for value in self.confidences) else ()
        if not any(self.weights):
            return Evidence.of_detection(alphabet, self.labels, stated).with_readings(measured)
        likelihoods = [
            None if each is None else np.array([each.get(name, 0.0) for name in alphabet.names])
            for each in self.weights
        ]
        return Evidence.of_slots(alphabet, likelihoods, self.labels, stated).with_readings(measured)


class RecordedTrial(NamedTuple):
    """One trial: t + 1 looks, and the t actions between them.

    Attributes:
        name: In the recording.
        looks: At least one.
        actions: Names of the actions.
        object: What was presented, if the recording says so: for scoring and teaching only.
    """

    name: str
    looks: tuple[RecordedLook, ...]
    actions: tuple[str, ...]
    object: str | None = None

    def readings_of(self, name: str) -> list[float]:
        """Return the readings of one sense, in the order of the looks."""
        return [value for look in self.looks for sense, value in look.measured if sense == name]


@dataclass(frozen=True)
class Recording:
    """Trials of one detector and one robot.

    Attributes:
        slots: Names of the slots.
        actions: Names of the actions that may occur.
        labels: Names of the labels that may occur.
        trials: In their order.
        n_objects: |O|, if it is said.
        n_aspects: |G|, if it is said.
        exclusive: Whether a label is in one slot only.
        place: The file, for error messages.
        senses: Of the object, that looks may have readings of: what is known of each beforehand, or its name alone.
    """

    slots: tuple[str, ...]
    actions: tuple[str, ...]
    labels: tuple[str, ...]
    trials: tuple[RecordedTrial, ...]
    n_objects: int | None = None
    n_aspects: int | None = None
    exclusive: bool = False
    place: str = "recording"
    senses: tuple[ObjectSense | str, ...] = ()

    @property
    def sense_names(self) -> tuple[str, ...]:
        """Names of the senses of the object."""
        return tuple(each if isinstance(each, str) else each.name for each in self.senses)

    def taught_as(self, name: str) -> Recording:
        """Return the recording with all trials of the object of this name."""
        return replace(self, trials=tuple(trial._replace(object=name) for trial in self.trials))

    def assumptions(self, n_objects: int | None = None, *, is_open: bool = True) -> Assumptions:
        """Return what a robot with this detector takes for granted.

        Args:
            n_objects: |O|, if the recording does not say.
            is_open: Whether labels may come that are not in this recording.

        Raises:
            InvalidInputError: Nobody says how many objects there are, or there are too many patterns.
        """
        n_objects = n_objects or self.n_objects
        if n_objects is None:
            raise InvalidInputError(f"{self.place}: does not say how many objects there are; expected --objects N")
        with placed(self.place):
            alphabet = PatternAlphabet.named(self.slots, self.labels, exclusive=self.exclusive, is_open=is_open)
            n_aspects = self.n_aspects or min(len(alphabet), USUAL_ASPECTS)
            senses = tuple(self._sense(each) if isinstance(each, str) else each for each in self.senses)
            return Assumptions(n_objects, n_aspects, self.actions, alphabet, senses)

    def _sense(self, name: str) -> ObjectSense:
        """Return what the readings of a sense say of it: actions reveal one if a reading mostly comes after them."""
        after = Counter[str]()
        for trial in self.trials:
            for action, look in zip(trial.actions, trial.looks[1:], strict=False):
                after[action] += 1 if name in dict(look.measured) else -1
        revealing = tuple(action for action in self.actions if after[action] > 0)
        return ObjectSense.of_readings(name, [trial.readings_of(name) for trial in self.trials], revealing)


def check_fits(recording: Recording, assumptions: Assumptions) -> None:
    """Raise ``InvalidInputError`` if a memory under these assumptions cannot take a recording.

    Labels that an open alphabet lacks are no fault: see ``assumptions_for``.
    """
    if recording.slots != assumptions.alphabet.slots:
        raise InvalidInputError(
            f"{recording.place}: slots {listed(recording.slots)}; expected those of the memory: "
            f"{listed(assumptions.alphabet.slots)}"
        )
    known = {sense.name for sense in assumptions.object_senses}
    for name in senses_of(recording.trials):
        if name not in known:
            there = f"those of the memory: {listed(known)}" if known else "none, as the memory was begun without"
            raise InvalidInputError(f"{recording.place}: readings of {name!r}; expected {there}")
    for trial in recording.trials:
        for step, action in enumerate(trial.actions):
            assumptions.action_index(action, f"{recording.place}: trial {trial.name}, step {step}: action")


def assumptions_for(recording: Recording, assumptions: Assumptions) -> Assumptions:
    """Return the assumptions of a memory, with the labels of a recording that its open alphabet lacks.

    Raises:
        InvalidInputError: The recording does not fit, or has a label that a closed alphabet lacks.
    """
    check_fits(recording, assumptions)
    alphabet = assumptions.alphabet
    if not alphabet.names:
        raise InvalidInputError(
            f"{recording.place}: has labels, and the memory numbers alone; expected a memory that knows labels"
        )
    with placed(recording.place):
        extended = alphabet.extended(used_labels(recording.trials))
    return assumptions if extended is alphabet else replace(assumptions, alphabet=extended)


def used_labels(trials: Sequence[RecordedTrial]) -> list[str]:
    """Return the labels that occur in trials, in the order in which they come up."""
    found: dict[str, None] = {}
    for trial in trials:
        for look in trial.looks:
            found.update(dict.fromkeys(label for label in look.labels if label is not None))
            for weights in look.weights:
                found.update(dict.fromkeys(weights or ()))
    return list(found)


def senses_of(trials: Sequence[RecordedTrial]) -> list[str]:
    """Return the names of the senses of the object that trials have readings of, in the order in which they come up."""
    return list(dict.fromkeys(name for trial in trials for look in trial.looks for name, _ in look.measured))
