"""What is no value of the right kind is refused by name, wherever a user can hand it in."""

import numpy as np
import pytest

import atg_fg
from atg_fg import (
    Assumptions,
    Evidence,
    ModelParameters,
    PatternAlphabet,
    RobotMemory,
    TrialRecord,
    arcube_assumptions,
    begin_trial,
)
from atg_fg.core.checks import brief
from atg_fg.core.errors import AtgError

WRONG = (None, True, -1, 1.5, float("nan"), 10**5000, b"x", [None], {1: 2}, {3}, object(), np.array([[1.5]]), "\ud800")
PAPER = arcube_assumptions(10)
NAMED = PatternAlphabet.named(("front",), ("a", "b"), is_open=True)


def remembered():
    memory = RobotMemory(PAPER)
    memory.learn([0, 1], [0], None, "cup")
    return memory


def observed(look):
    engine = begin_trial("bayes-filter", remembered(), ModelParameters())
    engine.observe(look)
    return engine


CALLS = {
    "slots": lambda wrong: PatternAlphabet.named(wrong, ("a", "b")),
    "names": lambda wrong: PatternAlphabet.named(("front",), wrong),
    "n_symbols": lambda wrong: PatternAlphabet(("front", "top"), wrong),
    "more names": lambda wrong: NAMED.extended(wrong),
    "pattern": lambda wrong: PAPER.alphabet.index(wrong),
    "n_objects": arcube_assumptions,
    "actions": lambda wrong: Assumptions(3, 2, wrong, PAPER.alphabet),
    "alphabet": lambda wrong: Assumptions(3, 2, ("go",), wrong),
    "likelihood": lambda wrong: Evidence.of_likelihood(PAPER.alphabet, wrong),
    "likelihoods": lambda wrong: Evidence.of_slots(PAPER.alphabet, wrong),
    "assumptions": RobotMemory,
    "patterns": lambda wrong: RobotMemory(PAPER).learn(wrong, [0], None),
    "actions learned": lambda wrong: RobotMemory(PAPER).learn([0, 1], wrong, None),
    "matched": lambda wrong: remembered().learn([0, 1], [0], wrong if wrong is not None else 3),
    "old name": lambda wrong: remembered().rename(wrong, "mug"),
    "new name": lambda wrong: remembered().rename("cup", wrong),
    "memory": lambda wrong: begin_trial("bayes-filter", wrong, ModelParameters()),
    "parameters": lambda wrong: begin_trial("bayes-filter", remembered(), wrong),
    "engine": lambda wrong: begin_trial(wrong, remembered(), ModelParameters()),
    "policy": atg_fg.make_policy,
    "world": atg_fg.make_world,
    "preset": atg_fg.preset,
    "number of cubes": lambda wrong: atg_fg.make_arcubes(wrong, seed=0),
    "looks": lambda wrong: TrialRecord.from_looks(PAPER, wrong, []),
    "one look": lambda wrong: TrialRecord.from_looks(PAPER, [wrong if wrong is not None else 3], []),
    "actions done": lambda wrong: TrialRecord.from_looks(PAPER, [None, None], wrong),
    "look": lambda wrong: observed(wrong if wrong is not None else 3),
    "look of a slot": lambda wrong: observed({"front": wrong if wrong is not None else 1.5}),
    "memory to load": atg_fg.load_memory,
    "memory to open": atg_fg.open_memory,
    "place to save to": lambda wrong: atg_fg.save_memory(remembered(), wrong),
    "action": lambda wrong: observed((0, 1)).act(wrong),
}


#: What is a value there, after all.
RIGHT = {
    "actions learned": ["[None]"],
    "looks": ["[None]"],
    "look of a slot": ["{1: 2}"],
    "action": ["None"],
}


@pytest.mark.parametrize("what", CALLS)
def test_a_wrong_type_is_an_error_of_this_project_in_one_line(what):
    for wrong in (each for each in WRONG if brief(each) not in RIGHT.get(what, ())):
        with pytest.raises(AtgError) as refused:
            CALLS[what](wrong)
        message = str(refused.value)
        assert "expected" in message, message
        assert len(message) < 600


def test_a_trial_is_made_of_looks_as_an_engine_takes_them():
    assumptions = Assumptions(3, 2, ("go",), NAMED)
    looks = [("a",), {"front": "b"}, {"front": {"a": 0.8, "b": 0.2}}, None, Evidence.of_detection(NAMED, (0,))]
    record = TrialRecord.from_looks(assumptions, looks, ["go"] * 4)
    assert [*record.detections] == [(0,), (1,), (None,), (None,), (0,)]
    memory = RobotMemory(assumptions)
    atg_fg.learn_from(record, memory)
    assert memory.names == ("object-000",)
