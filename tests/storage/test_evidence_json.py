"""What was sampled goes into memory files and comes back, so that a memory goes on as if nothing had been."""

import copy
import json
from contextlib import closing

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.engines import begin_trial
from atg_fg.experiments.trial import learn_from, run_trial
from atg_fg.learning.structured_memory import memory_for
from atg_fg.policies import make_policy
from atg_fg.storage.memory_files import load_memory, save_memory
from atg_fg.storage.memory_json import memory_from_document, memory_to_document
from atg_fg.storage.presets import preset
from atg_fg.worlds.registry import assumptions_of, make_world

LEARNED = preset("learned")


def learned_in(world, memory, trials):
    """Let a memory learn from trials with these numbers; return the records."""
    records = []
    for number in trials:
        inference = begin_trial("learned-structure", memory, LEARNED)
        record = run_trial(world, inference, make_policy("random"), 6, np.random.default_rng(number))
        learn_from(record, memory)
        records.append(record)
    return records


def detector():
    return make_world("detector", n_objects=3, wrong=0.2, missing=0.1, slip=0.05, confidences=True)


def cubes():
    from atg_fg.worlds.arcube import make_arcubes

    return make_world("ideal", cubes=make_arcubes(4, 0), slip=0.1, wrong=0.2, missing=0.1)


@pytest.fixture(
    scope="module", params=[detector, pytest.param(cubes, marks=pytest.mark.slow)], ids=["detector", "cubes"]
)
def learned(request):
    with closing(request.param()) as world:
        memory = memory_for(LEARNED, RobotMemory(assumptions_of(world, 4)))
        learned_in(world, memory, range(9))
    return request.param, memory


@pytest.mark.parametrize("name", ["memory.json", "memory.db"])
def test_a_memory_that_was_saved_goes_on_as_if_it_had_not_been(learned, name, tmp_path):
    make, memory = learned
    save_memory(memory, tmp_path / name)
    loaded = load_memory(tmp_path / name)
    assert loaded == memory
    assert loaded.gain == memory.gain
    twin = memory.copy()
    with closing(make()) as world:
        first = learned_in(world, twin, [20, 21])
    with closing(make()) as world:
        second = learned_in(world, loaded, [20, 21])
    for one, two in zip(first, second, strict=True):
        assert np.array_equal(one.belief.probabilities, two.belief.probabilities)
    assert loaded == twin


def test_confidences_are_kept_as_they_were_given(learned, tmp_path):
    make, memory = learned
    save_memory(memory, tmp_path / "memory.db")
    loaded = load_memory(tmp_path / "memory.db")
    assert [trial.confidences for trial in loaded.learner.trials] == [
        trial.confidences for trial in memory.learner.trials
    ]
    assert any(trial.confidences for trial in loaded.learner.trials) == (make is detector)
    assert loaded.assumptions.alphabet.exclusive == (make is cubes)


def test_a_file_without_what_was_sampled_is_sampled_again(learned):
    _, memory = learned
    document = memory_to_document(memory)
    del document["structure"]["evidence"]
    loaded = memory_from_document(json.loads(json.dumps(document, default=float)))
    names = {
        name
        for belief in loaded.evidence.believed(loaded.names)
        for name in np.flatnonzero(np.isfinite(belief.log_prior))
    }
    assert names


FAULTS = {
    "sampled": (10_000, "sampled"),
    "weights": ([2.0], "weights"),
    "log_evidence": ("much", "log_evidence"),
    "chains": ([], "chains"),
    "noise": ({"wrong": 0.1}, "noise"),
    "reassignments": ([[1, 0, "object-000"]], "reassignments"),
}


@pytest.mark.parametrize("key", FAULTS)
def test_a_fault_is_told_with_its_place(learned, key):
    _, memory = learned
    document = json.loads(json.dumps(memory_to_document(memory)))
    document["structure"]["evidence"][key], place = FAULTS[key]
    with pytest.raises(InvalidInputError, match=f"structure.evidence.{place}"):
        memory_from_document(document)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("owner", [99]),
        ("start", [-1]),
        ("slips", [[0, 99]]),
        ("slip", 2.0),
        ("score", None),
        ("slips", [[0]]),
        ("wrong", [[0, 99]]),
        ("error", 0.0),
    ],
)
def test_a_fault_in_a_chain_is_told_with_its_place(learned, key, value):
    _, memory = learned
    document = json.loads(json.dumps(memory_to_document(memory)))
    chain = copy.deepcopy(document["structure"]["evidence"]["chains"][0])
    chain[key] = value
    document["structure"]["evidence"]["chains"][0] = chain
    with pytest.raises(InvalidInputError, match=rf"chains\[0\]\.{key}"):
        memory_from_document(document)
