"""What a notebook shows of ATGs, memories and trials."""

import numpy as np
import pytest

from atg_fg.assumptions import Assumptions, arcube_assumptions
from atg_fg.engines import begin_trial
from atg_fg.experiments import learn_from
from atg_fg.graph import AspectTransitionGraph
from atg_fg.memory import RobotMemory
from atg_fg.patterns import PatternAlphabet
from atg_fg.policies import make_policy
from atg_fg.presets import preset
from atg_fg.structure.learner import BelievedStructure
from atg_fg.structure.memory import StructuredMemory
from atg_fg.structure.shared_structure import SharedStructure
from atg_fg.trial import TrialRecord, run_trial
from atg_fg.trial_log import TrialOutcome
from atg_fg.worlds import make_world
from tests.test_html_table import Reader


def shown(thing):
    return Reader(thing._repr_html_()).texts


def bell(name="bell"):
    assumptions = Assumptions(3, 4, ("push", "<pull>"), PatternAlphabet(("colour", "sound"), 4))
    graph = AspectTransitionGraph(name, assumptions)
    graph.add_aspect((0, 1))
    graph.add_aspect((2, 3))
    graph.add_transition(0, 0, 1, 2)
    graph.add_transition(0, 0, 0)
    return graph


def test_an_atg_shows_where_each_action_led_from_each_aspect():
    assert shown(bell()) == [
        "bell: 2 of 4 aspects, 2 observed edges",
        *("aspect (colour, sound)", "push", "<pull>"),
        *("(0, 1)", "(0, 1); (2, 3) ×2", "·"),
        *("(2, 3)", "·", "·"),
        "· not yet tried; collection node: 2 unobserved",
    ]


def test_an_empty_atg_shows_that_it_is():
    texts = shown(AspectTransitionGraph("new", arcube_assumptions()))
    assert texts == ["new: 0 of 24 aspects, 0 observed edges", "· not yet tried; collection node: 24 unobserved"]


def test_a_name_is_escaped():
    assert shown(bell("<b>cup</b>"))[0].startswith("<b>cup</b>: 2 of 4")


def test_a_memory_shows_its_objects_and_a_large_one_the_first_of_them():
    graph = bell()
    texts = shown(RobotMemory(graph.assumptions, [graph]))
    assert texts[0] == "Robot memory: 1 of 3 objects"
    assert texts[5:9] == ["bell", "2 of 4", "2", "3"]
    many = RobotMemory(graph.assumptions, [bell(f"bell-{number}") for number in range(1000)])
    assert "… and 988 other objects" in shown(many)
    assert len(shown(many)) < 70


def test_a_memory_says_what_was_merged():
    graph = bell()
    memory = RobotMemory(graph.assumptions, [graph, bell("other")])
    memory.merge("bell", "other")
    assert shown(memory)[-1].endswith("1 merged into others")


def test_an_empty_memory_shows_what_it_takes_for_granted():
    assert shown(RobotMemory(arcube_assumptions())) == [
        "Robot memory: 0 of 100 objects",
        "actions flip, left, right; slots front, top of 12 symbols",
    ]


@pytest.fixture(scope="module")
def records():
    """Two trials with one cube: it is new, then known."""
    memory, found = RobotMemory(arcube_assumptions()), []
    with make_world("ideal") as world:
        for seed in range(2):
            inference = begin_trial("bayes-filter", memory, preset("default"))
            rng, policy = np.random.default_rng(seed), make_policy(("explore", "entropy")[seed])
            record = run_trial(world, inference, policy, (40, 6)[seed], rng, reset_options={"object": 3})
            learn_from(record, memory)
            found.append(record)
    return found


def test_a_trial_shows_each_look_and_how_it_ended(records):
    _, record = records
    texts = shown(record)
    assert texts[0] == "Trial of 6 actions: known, object-000"
    assert texts[texts.index("0") + 1] == str(record.detections[0])
    assert f"{record.belief.objects[0]:.3f}" in texts
    assert [text for text in texts if text in record.assumptions.actions] == [
        record.assumptions.actions[action] for action in record.actions
    ]


def test_a_long_trial_shows_the_first_looks(records):
    assert "… and 1 other looks" in shown(records[0])


def test_a_trial_with_nothing_in_it_shows_that():
    assert shown(TrialRecord((), arcube_assumptions()))[0] == "Trial of 0 actions: nothing seen yet"


def test_on_a_terminal_a_trial_is_one_line(records):
    assert repr(records[1]) == "<Trial of 6 actions: known, object-000>"


def test_an_outcome_shows_what_was_presented_and_seen(records):
    texts = shown(TrialOutcome.of(records[1]))
    assert texts[0] == "Trial of 6 actions: known, object-000"
    assert texts[3] == "3"
    assert texts[4].startswith(str(records[1].detections[0]))


def test_a_memory_that_learns_structure_says_what_it_believes(monkeypatch):
    memory = StructuredMemory(arcube_assumptions())
    assert shown(memory)[-1].endswith("; 0 raw trials; structures believed in: none")
    structure = SharedStructure(2, ((1, 0),) * 3)
    believed = [BelievedStructure(structure, weight, np.empty(0), np.empty(0)) for weight in (0.9, 0.05)]
    monkeypatch.setattr(memory.learner, "believed", lambda names: believed)
    assert shown(memory)[-1].endswith("; 0 raw trials; structures believed in: with weights 0.90, 0.05")
