"""What an engine hands out cannot change it, and a copy of an engine shares nothing with it."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np
import pytest

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import AtgError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, PatternAlphabet
from atg_fg.engines import ENGINES, begin_trial
from atg_fg.inference.interface import Inference
from tests.small import graph

ASSUMPTIONS = Assumptions(6, 3, ("push", "pull"), PatternAlphabet(("front", "top"), 3))
PARAMETERS = ModelParameters(0.5, 0.1, learn_in_trial=True)
#: Looks and actions by turns; some looks are new to some objects, one is partial.
STEPS = ((0, 1), 0, (1, 0), 1, (2, 1), 0, (1, None), 1, (0, 1))
#: Few samples, and large-memory with its classes.
OPTIONS: dict[str, dict[str, Any]] = {
    "gibbs": {"n_sweeps": 20, "n_burn_in": 5},
    "particle": {"n_particles": 50},
    "large-memory": {"n_exact": 0},
}


def memory() -> RobotMemory:
    return RobotMemory(
        ASSUMPTIONS,
        [
            graph(ASSUMPTIONS, "first", [(0, 1), (1, 0)], (0, 0, 1, 3), (1, 1, 0, 2)),
            graph(ASSUMPTIONS, "second", [(0, 1), (2, 1), (1, 2)], (0, 0, 1, 1), (1, 0, 2, 4)),
            graph(ASSUMPTIONS, "third", [(2, 0)]),
        ],
    )


def begun(engine: str) -> Inference:
    return begin_trial(engine, memory(), PARAMETERS, **OPTIONS.get(engine, {}))


def go_on(inference: Inference, step: Any) -> None:
    if isinstance(step, tuple):
        inference.observe(Evidence.of_detection(ASSUMPTIONS.alphabet, step))
    else:
        inference.act(step)


#: What subclasses fill: these change the engine, or want arguments.
HOOKS = (
    "update",
    "predict",
    "propagate",
    "correct",
    "solve",
    "make_tables",
    "learn_from_look",
    "compute_smoothed_aspects",
)


def public_results(inference: Inference) -> Iterator[Any]:
    """Every public attribute, and what every public method returns; what is refused at this time is left out."""
    for name in dir(inference):
        if name.startswith("_") or name in ("observe", "act", *HOOKS):
            continue
        try:
            value = getattr(inference, name)
            if name == "smoothed_aspects":
                value = [value(hypothesis) for hypothesis in range(len(inference.memory) + 1)]
            yield value() if callable(value) else value
        except AtgError:
            continue


def arrays_in(value: Any, met: set[int]) -> Iterator[np.ndarray]:
    """All arrays that can be reached from a value through containers and objects of this library."""
    if id(value) in met:
        return
    met.add(id(value))
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, Mapping):
        yield from (array for each in value.values() for array in arrays_in(each, met))
    elif isinstance(value, (tuple, list)):
        yield from (array for each in value for array in arrays_in(each, met))
    elif type(value).__module__.startswith("atg_fg."):
        yield from arrays_in({n: v for n, v in getattr(value, "__dict__", {}).items() if public(n)}, met)


def public(name: str) -> bool:
    return not name.startswith("_")


def answers(inference: Inference) -> list[np.ndarray]:
    found = [inference.identity().probabilities, inference.aspect_belief, np.array(inference.log_evidence)]
    if not inference.history.awaits_evidence:
        found += [inference.expected_entropies(), inference.shown_patterns()]
    if inference.history.evidence:
        found += inference.smoothed_aspects(0)
    return [np.array(each) for each in found]


def assert_same(ours: list[np.ndarray], theirs: list[np.ndarray]) -> None:
    for one, other in zip(ours, theirs, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("engine", ENGINES)
def test_whatever_is_written_into_results_the_engine_stays_as_it_was(engine: str) -> None:
    inference, untouched = begun(engine), begun(engine)
    for step in (None, *STEPS):
        if step is not None:
            go_on(inference, step)
            go_on(untouched, step)
        for result in public_results(inference):
            for array in arrays_in(result, set()):
                if array.flags.writeable and array.size:
                    array[...] = 0
        assert_same(answers(inference), answers(untouched))


@pytest.mark.parametrize("engine", ENGINES)
def test_evidence_and_priors_that_change_afterwards_change_nothing(engine: str) -> None:
    likelihood = np.array([1.0, 0.5, 0.0, 0.0, 0.25, 0.0])
    evidence = Evidence(likelihood)
    inference = begun(engine)
    inference.observe(evidence)
    before = answers(inference)
    likelihood[:] = 0.125
    with pytest.raises(ValueError, match="read-only"):
        evidence.likelihood[0] = 0.0
    assert_same(answers(inference), before)


@pytest.mark.parametrize(
    "copied",
    [copy.copy, copy.deepcopy, lambda inference: pickle.loads(pickle.dumps(inference))],
    ids=["copy", "deepcopy", "pickle"],
)
@pytest.mark.parametrize("engine", ENGINES)
def test_a_copy_goes_on_alike_and_shares_nothing(engine: str, copied: Callable[[Inference], Inference]) -> None:
    inference = begun(engine)
    for number, step in enumerate(STEPS):
        go_on(inference, step)
        if number % 3 == 0:
            answers(inference)  # what is kept between questions is copied, too
            other = copied(inference)
            ours, theirs = (list(arrays_in_all(each, set())) for each in (inference, other))
            assert not any(np.shares_memory(one, another) for one in ours for another in theirs)
            before = answers(inference)
            for later in STEPS[number + 1 :]:
                go_on(other, later)
            assert_same(answers(inference), before)
    assert other.options == inference.options
    rest = copied(inference)
    go_on(rest, 0)
    go_on(inference, 0)
    assert_same(answers(rest), answers(inference))


def arrays_in_all(value: Any, met: set[int]) -> Iterator[np.ndarray]:
    """All arrays that can be reached from a value, private attributes included."""
    if id(value) in met or value is None:
        return
    met.add(id(value))
    if isinstance(value, np.ndarray):
        yield value
    elif isinstance(value, Mapping):
        yield from (array for each in value.values() for array in arrays_in_all(each, met))
    elif isinstance(value, (tuple, list)):
        yield from (array for each in value for array in arrays_in_all(each, met))
    elif type(value).__module__.startswith("atg_fg."):
        yield from arrays_in_all(getattr(value, "__dict__", {}), met)


def test_a_belief_tree_is_of_the_time_at_which_it_was_asked_for() -> None:
    inference = begun("bayes-filter")
    go_on(inference, (0, 1))
    tree = inference.belief_tree()
    before = tree.expected_entropies()
    for step in STEPS[1:]:
        go_on(inference, step)
    np.testing.assert_array_equal(tree.expected_entropies(), before)
