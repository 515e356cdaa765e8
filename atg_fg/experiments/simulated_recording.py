"""A world in place of a robot: recordings of what it shows while it is acted on at random."""

from __future__ import annotations

from contextlib import closing
from typing import Any

import numpy as np

from atg_fg.core.checks import MANY, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.looks import confidences_in
from atg_fg.core.recordings import RecordedLook, RecordedTrial, Recording
from atg_fg.worlds.base import World, detection_of
from atg_fg.worlds.registry import assumptions_of, make_world_with, sense_of


def simulated_recording(
    name: str,
    n_objects: int,
    n_trials: int,
    n_actions: int,
    /,
    seed: int,
    objects_seed: int | None = None,
    **options: Any,
) -> Recording:
    """Return trials in a world, with objects, beginnings and actions drawn at random.

    The objects are drawn by the first child of a ``SeedSequence``, each trial has one of the others, as in the tests of
    ``run_test``.

    Args:
        name: Of the world.
        n_objects: |O|.
        n_trials: How many.
        n_actions: Of each trial, at most.
        seed: Of all that is drawn.
        objects_seed: Of the objects, if they are to be those of another recording.
        options: Of the world's own.

    Raises:
        InvalidInputError: The world cannot be made, or shows no symbols.
    """
    for place, count in (("n_objects", n_objects), ("n_trials", n_trials), ("n_actions", n_actions)):
        whole_number(count, place, 1, MANY)
    _, *trial_seeds = np.random.SeedSequence(seed).spawn(1 + n_trials)
    (of_objects,) = np.random.SeedSequence(seed if objects_seed is None else objects_seed).spawn(1)
    drawn = int(np.random.default_rng(of_objects).integers(2**31))
    with closing(make_world_with(name, n_objects, drawn, **options)) as world:
        if sense_of(world) is not None:
            raise InvalidInputError(f"world {name!r}: shows pictures; expected a world that shows symbols")
        assumptions = assumptions_of(world, n_objects)
        alphabet = assumptions.alphabet
        labels = alphabet.names or tuple(map(str, range(alphabet.n_symbols)))
        trials = [
            _trial(str(number), world, labels, assumptions.actions, n_actions, np.random.default_rng(trial_seed))
            for number, trial_seed in enumerate(trial_seeds)
        ]
    return Recording(
        alphabet.slots,
        assumptions.actions,
        labels,
        tuple(trials),
        assumptions.n_objects,
        assumptions.n_aspects,
        alphabet.exclusive,
        name,
    )


def _trial(
    name: str, world: World, labels: tuple[str, ...], names: tuple[str, ...], n_actions: int, rng: np.random.Generator
) -> RecordedTrial:
    looks: list[RecordedLook] = []
    actions: list[str] = []
    observation, truth = world.reset(seed=int(rng.integers(2**31)))
    presented = None if truth.get("object") is None else f"object {truth['object']}"
    while not truth.get("lost"):
        seen = tuple(None if symbol is None else labels[symbol] for symbol in detection_of(observation))
        looks.append(RecordedLook(seen, confidences_in(truth)))
        if len(actions) == n_actions:
            break
        action = int(rng.integers(len(names)))
        actions.append(names[action])
        observation, _, terminated, truncated, truth = world.step(np.int64(action))
        n_actions = len(actions) if terminated or truncated else n_actions
    # The action by which an object was lost led to no look.
    return RecordedTrial(name, tuple(looks), tuple(actions[: len(looks) - 1]), presented)
