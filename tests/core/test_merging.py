import json

import numpy as np
import pytest

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import PatternAlphabet
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage import memory_json
from tests.learning.test_structured_memory import add
from tests.learning.worlds import ARCUBES, cubes, trial_of

SMALL = Assumptions(9, 3, ("push",), PatternAlphabet(("front",), 5))


def small_memory():
    memory = RobotMemory(SMALL)
    memory.learn([0, 1, 2], [0, 0], None)
    memory.learn([3], [], None)
    memory.learn([1, 2, 3, 3], [0, 0, 0], None)
    return memory


@pytest.fixture(scope="module")
def structured():
    """Cube 0 twice, as a false novelty leaves it, between two others."""
    rng = np.random.default_rng(0)
    memory = StructuredMemory(ARCUBES)
    for number in (0, 1, 0, 2):
        add(memory, trial_of(cubes(3)[number], 10, rng))
    add(memory, trial_of(cubes(3)[0], 10, rng), matched="object-002")
    return memory


def test_merging_adds_aspects_and_counts_and_respects_the_number_of_aspects():
    memory = small_memory()
    memory.merge("object-000", "object-002")
    merged = memory["object-000"]
    assert memory.names == ("object-000", "object-001")
    assert merged.aspects == ((0,), (1,), (2,))
    assert merged.counts == {(0, 0, 1): 1, (1, 0, 2): 2}


def test_undoing_a_merge_restores_the_memory_exactly():
    memory = small_memory()
    before = memory_json.memory_to_json(memory)
    memory.merge("object-000", "object-001")
    memory.merge("object-002", "object-000")
    assert memory != small_memory()
    memory.unmerge("object-000")
    memory.unmerge("object-001")
    assert memory == small_memory()
    assert memory_json.memory_to_json(memory) == before


def test_with_structure_too_and_the_raw_trials_go_along(structured):
    memory, before = structured.copy(), memory_json.memory_to_json(structured)
    memory.merge("object-000", "object-002")
    assert memory.learner.owners == ["object-000", "object-001", "object-000", "object-003", "object-000"]
    (one, *_), (two, *_) = (each.learner.believed(["object-000"]) for each in (memory, structured))
    assert one.contents.sum() >= two.contents.sum() - 1e-6
    loaded = memory_json.memory_from_json(memory_json.memory_to_json(memory))
    assert loaded == memory
    for each in (memory, loaded):
        each.unmerge("object-002")
        assert each == structured
        assert memory_json.memory_to_json(each) == before
        for mine, old in zip(
            each.learner.believed(each.names), structured.learner.believed(structured.names), strict=True
        ):
            np.testing.assert_allclose(mine.contents, old.contents, atol=1e-6)


def test_what_was_learned_since_stays_with_the_one_that_was_kept():
    memory = small_memory()
    memory.merge("object-001", "object-000")
    memory.learn([0, 1, 0], [0, 0], matched="object-001")
    memory.unmerge("object-000")
    assert memory["object-000"] == small_memory()["object-000"]
    kept = memory["object-001"]
    assert kept.aspects == ((3,), (0,), (1,))
    assert kept.counts == {(1, 0, 2): 1, (2, 0, 1): 1}


def test_a_name_that_was_merged_is_not_given_again():
    memory = small_memory()
    memory.merge("object-000", "object-002")
    assert memory.learn([4], [], None) == "object-003"
    with pytest.raises(InvalidInputError, match="'object-002' is repeated"):
        memory.add(AspectTransitionGraph("object-002", SMALL))
    assert memory.copy() == memory


def test_what_cannot_be_merged_or_undone_is_refused():
    memory = small_memory()
    with pytest.raises(InvalidInputError, match="'object-000' with itself"):
        memory.merge("object-000", "object-000")
    for pair in (("object-000", "cup"), ("cup", "object-000")):
        with pytest.raises(UnknownNameError, match="cup"):
            memory.merge(*pair)
    with pytest.raises(UnknownNameError, match="unmerge: unknown name 'object-000'"):
        memory.unmerge("object-000")
    assert memory == small_memory()
    memory.merge("object-000", "object-001")
    memory.merge("object-000", "object-002")
    with pytest.raises(InvalidInputError, match="expected 'object-002', which was merged later, to be undone first"):
        memory.unmerge("object-001")
    with pytest.raises(InvalidInputError, match="other assumptions"):
        memory["object-000"].absorb(AspectTransitionGraph("cube", ARCUBES))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda d: d.update(merges={}), "merges: {}; expected a list"),
        (lambda d: d["merges"][0].pop("kept"), r"merges\[0\]: key 'kept' is missing"),
        (lambda d: d["merges"][0]["kept"].update(name="cup"), r"merges\[0\].kept: 'cup'; expected the name of an ATG"),
        (lambda d: d["merges"][0]["dropped"].update(name="object-001"), r"merges\[0\].dropped: 'object-001'"),
        (lambda d: d["merges"][0].update(position=-1), r"merges\[0\].position: -1"),
        (lambda d: d["merges"][0].update(trials=[99]), r"merges\[0\].trials: 99; expected less than 5"),
        (lambda d: d["merges"][0].update(trials=["x"]), r"merges\[0\].trials\[0\]: 'x'"),
        (lambda d: d["merges"][0]["dropped"].update(aspects=[[1, 1]]), r"merges\[0\].dropped.aspects\[0\]"),
    ],
)
def test_a_malformed_record_of_merges_is_refused(structured, change, message):
    memory = structured.copy()
    memory.merge("object-000", "object-002")
    document = json.loads(memory_json.memory_to_json(memory))
    change(document)
    with pytest.raises(InvalidInputError, match=message) as caught:
        memory_json.memory_from_json(json.dumps(document), "bad.json")
    assert str(caught.value).startswith("bad.json: merges")


def test_records_that_do_not_fit_what_is_there_now_are_undone_without_harm():
    memory = small_memory()
    memory.merge("object-000", "object-002")
    document = json.loads(memory_json.memory_to_json(memory))
    document["memory"][0].update(aspects=[[4]], transitions=[])
    loaded = memory_json.memory_from_json(json.dumps(document))
    loaded.unmerge("object-002")
    assert loaded["object-002"] == small_memory()["object-002"]
