"""Boxes whose lid comes off for good: the structure is learned, and what cannot be undone is not planned for."""

import numpy as np
import pytest

from atg_fg.core.goals import Goal
from atg_fg.core.patterns import Evidence
from atg_fg.display.completed_picture import draw_completed_atg
from atg_fg.engines import begin_trial
from atg_fg.learning.completion import completed_atg, pose_graph
from atg_fg.policies.goal import GoalPolicy
from atg_fg.policies.shortest_paths import shortest_path
from atg_fg.storage.presets import preset
from tests.learning.boxes import ASSUMPTIONS, BOXES, INSIDE, LID_BOX, OPEN, box_memory, tops_of


@pytest.fixture(scope="module")
def memory():
    return box_memory()


@pytest.fixture(scope="module")
def believed(memory):
    return memory.learner.believed(memory.names)[0]


def test_the_structure_of_boxes_is_learned(believed):
    assert believed.structure == LID_BOX
    assert len(LID_BOX.poses().registers) == 8
    assert believed.weight > 0.99
    assert (believed.followers > 0.99).all()


def test_what_boxes_contain_is_learned_whether_they_were_found_open_or_not(believed):
    for number, contents in enumerate(believed.contents):
        lid_tag, inside_tag = tops_of(BOXES[number])
        assert contents[INSIDE].argmax() == inside_tag
        assert contents[INSIDE].max() > 0.99
        # A lid that was never seen is not known; one that was is.
        assert contents[2].max() < 0.1 or contents[2].argmax() == lid_tag


def test_a_completed_box_has_no_way_back(memory):
    completed = completed_atg(memory, memory.names[0])
    assert len(completed) == 8
    tops = dict(completed.nodes(data="symbols"))
    _, inside_tag = tops_of(BOXES[0])
    changes = {(tops[source][2], tops[target][2]) for source, target in completed.edges()}
    assert not any(source == inside_tag != target for source, target in changes)
    assert any(source != inside_tag == target for source, target in changes)
    draw_completed_atg(completed, ASSUMPTIONS)


def test_a_path_leads_to_the_inside_and_none_back_to_the_lid(memory, believed):
    poses, contents = LID_BOX.poses(), np.eye(12)[[5, 3, 8, 1, 0, 9]]
    graph = pose_graph(poses, contents, memory.learner.rates, ASSUMPTIONS.alphabet)
    inside = [5, 3, 8, 1, 0, 9][INSIDE]
    lid, inside_goal = (Goal.of_slots(ASSUMPTIONS.alphabet, {"top": tag}) for tag in (8, inside))
    opened = int(poses.successors[0, OPEN])
    assert shortest_path(graph, 0, inside_goal).actions == (OPEN,)
    assert shortest_path(graph, opened, lid) is None


@pytest.mark.parametrize(("is_opened", "purpose"), [(False, "reached"), (True, "unreachable")])
def test_the_lid_of_an_opened_box_is_out_of_reach(memory, believed, is_opened, purpose):
    # A box of which both tags are known.
    number = int((believed.contents[:, 2].max(axis=1) * believed.contents[:, INSIDE].max(axis=1)).argmax())
    box, (lid_tag, _) = BOXES[number], tops_of(BOXES[number])
    state = next(s for s, pattern in enumerate(box.patterns) if pattern[2] == lid_tag)
    inference = begin_trial("learned-structure", memory, preset("learned"))
    policy = GoalPolicy(Goal.of_slots(ASSUMPTIONS.alphabet, {"top": lid_tag}), entropy_threshold=0.9)
    for action in [None, 1, 1, *([OPEN] if is_opened else [])]:
        if action is not None:
            inference.act(action)
            state = int(box.successors[state][action])
        inference.observe(Evidence.of_detection(ASSUMPTIONS.alphabet, box.patterns[state]))
    assert inference.identity().objects[number] > 0.99
    assert policy.choose(inference, np.random.default_rng(0)).purpose == purpose
