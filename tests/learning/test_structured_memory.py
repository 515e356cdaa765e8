import json

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import Evidence
from atg_fg.learning.structured_memory import OUTDONE, StructuredMemory, memory_for
from atg_fg.storage import memory_files, memory_json
from atg_fg.storage.presets import preset
from tests.learning.worlds import ARCUBES, PRISM, cubes, prisms, trial_of


def add(memory, trial, matched=None):
    patterns = [Evidence.of_detection(ARCUBES.alphabet, look).pattern for look in trial.detections]
    name = memory.learn(patterns, list(trial.actions), matched)
    memory.learn_shared(name, trial.detections, trial.actions)
    return name


@pytest.fixture(scope="module")
def memory():
    rng = np.random.default_rng(0)
    result = StructuredMemory(ARCUBES)
    for cube in cubes(4):
        name = add(result, trial_of(cube, 8, rng, missing=0.05))
        add(result, trial_of(cube, 8, rng), matched=name)
    return result


def section_changed(memory, change):
    document = json.loads(memory_json.memory_to_json(memory))
    change(document["structure"])
    return json.dumps(document)


def test_saving_and_loading_changes_nothing(memory, tmp_path):
    memory_files.save_memory(memory, tmp_path / "memory.json")
    loaded = memory_files.load_memory(tmp_path / "memory.json")
    assert loaded == memory
    assert memory_json.memory_to_json(loaded) == memory_json.memory_to_json(memory)
    for mine, yours in zip(memory.learner.believed(memory.names), loaded.learner.believed(memory.names), strict=True):
        np.testing.assert_allclose(mine.contents, yours.contents, atol=1e-6)


def test_a_loaded_memory_learns_on_as_the_old_one_does(memory):
    loaded, old = memory_json.memory_from_json(memory_json.memory_to_json(memory)), memory.copy()
    for seed in range(3):
        trial = trial_of(cubes(6)[4 + seed % 2], 8, np.random.default_rng(seed))
        assert add(old, trial) == add(loaded, trial)
    assert loaded == old


def test_a_copy_learns_without_touching_the_original(memory):
    before = memory_json.memory_to_json(memory)
    twin = memory.copy()
    assert twin == memory
    add(twin, trial_of(cubes(5)[4], 8, np.random.default_rng(9)))
    assert twin != memory
    assert memory_json.memory_to_json(memory) == before


def test_files_of_a_memory_without_structure_are_as_they_were(memory):
    plain = RobotMemory(ARCUBES, memory)
    document = json.loads(memory_json.memory_to_json(plain))
    assert set(document) == {"format", "version", "assumptions", "memory"}
    loaded = memory_json.memory_from_json(json.dumps(document))
    assert type(loaded) is RobotMemory
    assert loaded == plain
    assert plain != memory


def test_an_old_memory_begins_to_learn_structure_with_the_preset(memory):
    plain = RobotMemory(ARCUBES, memory)
    assert memory_for(preset("default"), plain) is plain
    grown = memory_for(preset("learned"), plain)
    assert isinstance(grown, StructuredMemory)
    assert grown.names == plain.names
    assert memory_for(preset("learned"), grown) is grown


def test_a_trial_of_an_unknown_object_is_refused(memory):
    with pytest.raises(UnknownNameError, match="stranger"):
        memory.copy().learn_shared("stranger", [(0, 1)], [])


@pytest.mark.parametrize(
    ("detections", "actions", "message"),
    [
        ([(0, 1)], [0], "1 looks, 1 actions; expected one look more"),
        ([(0, 1), (0, 0)], [0], "look 1, slot 'top': symbol 0 is repeated"),
        ([(0, 1), (1, 2)], [3], "action 3; expected 0 to 2"),
    ],
)
def test_what_is_no_trial_is_refused(memory, detections, actions, message):
    with pytest.raises(InvalidInputError, match=message):
        memory.copy().learn_shared("object-000", detections, actions)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda s: s.pop("rates"), "structure: key 'rates' is missing"),
        (lambda s: s.update(more=1), "structure: unknown key 'more'"),
        (lambda s: s.update(seed=-1), "structure.seed: -1"),
        (lambda s: s["rates"].update(slip=2.0), "structure.rates: rate slip: 2.0; expected a number between 0 and 1"),
        (lambda s: s["rates"].pop("share"), "structure.rates: key 'share' is missing"),
        (lambda s: s["rates"].update(slip=None), "structure.rates: rate slip: None; expected a number between 0 and 1"),
        (lambda s: s.update(candidates={}), "structure.candidates: {}; expected a list"),
        (lambda s: s.update(candidates=s["candidates"] * 11), "expected at most 10"),
        (lambda s: s["candidates"][0]["sources"].pop("flip"), r"candidates\[0\].sources: key 'flip' is missing"),
        (lambda s: s["candidates"][0]["sources"].update(left=[0, 0]), r"candidates\[0\].sources.left: \[0, 0\]"),
        (lambda s: s["trials"][0].update(object="stranger"), r"trials\[0\].object: 'stranger'; expected the name"),
        (lambda s: s["trials"][0].update(object=["x"]), r"trials\[0\].object: \['x'\]"),
        (lambda s: s["trials"][1]["actions"].append("flip"), r"trials\[1\]: 9 looks, 9 actions"),
        (lambda s: s["trials"][1]["actions"].__setitem__(0, "jump"), r"trials\[1\].actions\[0\]: 'jump'"),
        (lambda s: s["trials"][1]["observed"].__setitem__(2, [1]), r"trials\[1\].observed\[2\]: \[1\]; expected one"),
        (lambda s: s["trials"][1]["observed"].__setitem__(2, "x"), r"trials\[1\].observed\[2\]: 'x'; expected a list"),
        (lambda s: s.update(trials=3), "structure.trials: 3; expected a list"),
    ],
)
def test_a_malformed_section_is_refused_with_place_and_value(memory, change, message):
    with pytest.raises(InvalidInputError, match=message) as caught:
        memory_json.memory_from_json(section_changed(memory, change), "bad.json")
    assert str(caught.value).startswith("bad.json: structure")


def test_structures_are_searched_for_at_milestones_though_the_model_in_which_looks_err_is_ahead():
    """Of few prisms it explains more than plain ATGs do; at the next milestone trials merge."""
    rng, memory, ahead = np.random.default_rng(3), StructuredMemory(ARCUBES), []
    for prism in prisms(10, seed=3):
        add(memory, trial_of(prism, 10, rng))
        ahead.append(memory.gain > OUTDONE)
    assert ahead[7:] == [True, True, False]
    assert not memory.erring
    assert memory.learner.believed([])[0].structure == PRISM
