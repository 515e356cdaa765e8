"""Posteriors of tiny trials by hand; every exact engine has to give them."""

from math import log

import numpy as np
import pytest

from atg_fg.core.belief import IdentityBelief, entropies
from atg_fg.core.errors import ImpossibleEvidenceError, InvalidInputError, UnknownNameError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.engines import begin_trial
from tests.core.test_table import Reader
from tests.small import every_exact_engine, graph, one_slot, seen, trial

EXACT = ModelParameters(0.0, 0.0, learn_in_trial=False)
EXACT_LEARNING = ModelParameters(0.0, 0.0, learn_in_trial=True)


def one_known_aspect() -> RobotMemory:
    """N = 3, G = 2, three patterns; object A is known to show pattern 0. So U = 2."""
    assumptions = one_slot(3, 2, 3)
    return RobotMemory(assumptions, [graph(assumptions, "A", [(0,)])])


def close(expected: float) -> object:
    return pytest.approx(expected, rel=0, abs=1e-14)


@every_exact_engine
def test_one_look_by_hand(engine: str) -> None:
    # A: 1/3 prior · (1/2 its aspect · 1 + 1/2 C · 0) = 1/6 = 3/18.  unseen: 2/3 · 1/3 = 2/9 = 4/18.
    inference = trial(engine, one_known_aspect(), EXACT, 0)
    belief = inference.identity()
    assert belief.objects[0] == close(3 / 7)
    assert belief.unseen == close(4 / 7)
    assert inference.log_evidence == close(log(7 / 18))
    # Two unseen objects with 2/7 each.
    assert belief.entropy == close(-3 / 7 * log(3 / 7) - 2 * 2 / 7 * log(2 / 7))


@every_exact_engine
def test_expected_entropy_by_hand(engine: str) -> None:
    # After pattern 0 as above (A 3/7, unseen 4/7). Push was never tried, so A shows 0 with 1/2, and 1 or 2 with 1/4;
    # unseen shows each with 1/3.
    # z = 0: A 3/14 = 9/42, unseen 4/21 = 8/42.   z = 1 or 2: A 3/28 = 9/84, unseen 16/84.
    def entropy(a: float, unseen: float) -> float:
        return -a * log(a) - unseen * log(unseen / 2)

    expected = 17 / 42 * entropy(9 / 17, 8 / 17) + 2 * 25 / 84 * entropy(9 / 25, 16 / 25)
    inference = trial(engine, one_known_aspect(), EXACT, 0)
    assert inference.expected_entropies().tolist() == [close(expected)]


@every_exact_engine
def test_another_look_by_hand(engine: str) -> None:
    # Joint with z = 1 as above: A 9/84, unseen 16/84; of all 7/18 · 25/84.
    inference = trial(engine, one_known_aspect(), EXACT, 0, 0, 1)
    assert inference.identity().objects[0] == close(9 / 25)
    assert inference.identity().unseen == close(16 / 25)
    assert inference.log_evidence == close(log(7 / 18 * 25 / 84))


@every_exact_engine
def test_learning_within_the_trial_by_hand(engine: str) -> None:
    # Look 0: A 3/7, unseen 4/7 as above, but now unseen knows an aspect that shows 0, just as A does.
    # Push, look 1: from an untried aspect both give 1/2 to C, and C 1/2 to each pattern left: 1/4. No change.
    # Now both know 0, 1 (G = 2, so no C any more), and push led 0 → 1 once.
    # Push, look 0: push was not tried from 1, so both give 1/2.
    # Push, look 1: both are certain (α = 0).
    inference = trial(engine, one_known_aspect(), EXACT_LEARNING, 0, 0, 1)
    assert inference.identity().unseen == close(4 / 7)
    assert inference.log_evidence == close(log(7 / 18 * 1 / 4))
    inference.act(0)
    inference.observe(seen(inference.memory.assumptions, 0))
    inference.act(0)
    inference.observe(seen(inference.memory.assumptions, 1))
    assert inference.identity().unseen == close(4 / 7)
    assert inference.log_evidence == close(log(7 / 18 * 1 / 4 * 1 / 2))
    # Nothing can tell A and unseen apart any more.
    assert inference.expected_entropies().tolist() == [close(inference.identity().entropy)]


@every_exact_engine
def test_belief_in_the_collection_node_is_divided_by_hand(engine: str) -> None:
    # |𝒵| = 2, G = 2, δ = 1/2, nothing remembered. Look 0: C shows it by (1/2)/2, or by noise (1/2)/2: half and half.
    # Push was not tried, so X_1 is the new node or C, 1/2 each. Look 0 again: the node shows it with 1/2 + 1/4, and C,
    # that is now known not to, with 1/4. So X_1 is the node with 3/4. X_0 stays half and half: its action told nothing.
    assumptions = one_slot(1, 2, 2)
    parameters = ModelParameters(0.0, 0.5, learn_in_trial=True)
    inference = trial(engine, RobotMemory(assumptions), parameters, 0)
    assert inference.smoothed_aspects(0)[0].tolist() == [close(1 / 2), close(1 / 2)]
    inference.act(0)
    inference.observe(seen(assumptions, 0))
    first, second = inference.smoothed_aspects(0)
    assert first.tolist() == [close(1 / 2), close(1 / 2)]
    assert second.tolist() == [close(1 / 4), close(3 / 4)]
    assert inference.log_evidence == close(log(1 / 2 * 1 / 2))
    # Push again. Node → node was counted once, so with α = 0 the node stays (3/4), and C goes to either (1/8 each).
    # X_2: node 7/8, C 1/8. Look 1: node 7/8 · 1/4 = 7/32; C 1/8 · ((1/2)/1 + 1/4) = 3/32. p(z) = 10/32.
    # The second node is the G-th, so it takes all that C had: X_2 is (0, 7/10, 3/10).
    # Behind it X_1: the node gave 3/4 · 1/4 = 6/32; C gave 1/8 · 1/4 = 1/32 and 3/32. So the node 6/10, C 4/10.
    inference.act(0)
    inference.observe(seen(assumptions, 1))
    first, second, third = inference.smoothed_aspects(0)
    assert third.tolist() == [close(0), close(7 / 10), close(3 / 10)]
    assert second[:2].tolist() == [close(4 / 10), close(6 / 10)]
    assert first[:2].tolist() == [close(1 / 2), close(1 / 2)]
    assert inference.log_evidence == close(log(1 / 4 * 10 / 32))


@every_exact_engine
def test_an_action_tells_objects_apart_that_look_the_same_by_hand(engine: str) -> None:
    # A and B show the same two patterns; push swaps them on A and keeps them on B. G = 2, N = 2, U = 1, |𝒵| = 2.
    # Look 0: A and B 1/3 · 1/2, unseen 1/3 · 1/2: 1/3 each.  Push, look 0: A 0, B 1, unseen 1/2.
    assumptions = one_slot(2, 2, 2)
    memory = RobotMemory(
        assumptions,
        [
            graph(assumptions, "A", [(0,), (1,)], (0, 0, 1, 1), (1, 0, 0, 1)),
            graph(assumptions, "B", [(0,), (1,)], (0, 0, 0, 1), (1, 0, 1, 1)),
        ],
    )
    inference = trial(engine, memory, EXACT, 0)
    assert inference.identity().objects.tolist() == [close(1 / 3), close(1 / 3)]
    # One look more: 0 leaves B : unseen = 2 : 1, and 1 leaves A : unseen = 2 : 1.
    assert inference.expected_entropies().tolist() == [close(log(3) - 2 / 3 * log(2))]
    inference.act(0)
    assert inference.identity().objects.tolist() == [close(1 / 3), close(1 / 3)]
    inference.observe(seen(assumptions, 0))
    assert inference.identity().objects.tolist() == [close(0), close(2 / 3)]
    assert inference.identity().most_probable_object == 1
    assert not inference.identity().is_novel


@every_exact_engine
def test_what_no_object_can_show_is_refused_and_the_trial_goes_on(engine: str) -> None:
    # G = 1: after pattern 0 the one aspect of unseen is known, and without noise pattern 1 cannot be.
    memory = RobotMemory(one_slot(1, 1, 2))
    inference = trial(engine, memory, EXACT_LEARNING, 0, 0)
    with pytest.raises(ImpossibleEvidenceError, match="observation 1"):
        inference.observe(seen(memory.assumptions, 1))
    inference.observe(seen(memory.assumptions, 0))
    assert inference.identity().unseen == 1
    assert inference.log_evidence == close(log(1 / 2))


def test_unseen_objects_are_counted_one_by_one_in_the_entropy() -> None:
    # Two remembered objects with 1/4 each, and 4 unseen ones with 1/8 each.
    belief = IdentityBelief(np.array([0.25, 0.25]), 0.5, n_unseen=4)
    assert belief.entropy == close(2 / 4 * log(4) + 4 / 8 * log(8))


def test_a_sure_belief_has_no_entropy() -> None:
    assert IdentityBelief(np.array([0.0, 1.0]), 0.0, n_unseen=98).entropy == 0
    assert IdentityBelief(np.array([]), 1.0, n_unseen=1).entropy == 0
    assert IdentityBelief(np.array([]), 1.0, n_unseen=100).entropy == close(log(100))


@pytest.mark.parametrize("n_objects", [0, 1, 7, 300])
def test_entropies_taken_at_once_are_those_taken_one_by_one_bit_for_bit(n_objects: int) -> None:
    rng = np.random.default_rng(n_objects)
    drawn = [rng.dirichlet(np.full(n_objects + 1, spread)) for spread in (0.01, 0.1, 1.0, 1.0, 10.0)]
    beliefs = [IdentityBelief.of(each, n_unseen) for n_unseen, each in enumerate(drawn, start=1)]
    assert entropies(beliefs) == [belief.entropy for belief in beliefs]
    assert entropies([]) == []


@pytest.mark.parametrize(("unseen", "novel"), [(0.5, False), (0.5000001, True), (0.4999999, False), (1.0, True)])
def test_an_object_is_novel_only_above_one_half(unseen: float, novel: bool) -> None:
    assert IdentityBelief(np.array([1 - unseen]), unseen, n_unseen=3).is_novel is novel


def test_the_most_probable_object_is_a_remembered_one_and_the_hypothesis_may_be_unseen() -> None:
    belief = IdentityBelief(np.array([0.1, 0.3]), 0.6, n_unseen=3)
    assert belief.most_probable_object == 1
    assert belief.most_probable_hypothesis == 2
    assert IdentityBelief(np.array([]), 1.0, n_unseen=3).most_probable_object is None
    assert IdentityBelief(np.array([]), 1.0, n_unseen=3).most_probable_hypothesis == 0


BELIEF = IdentityBelief(np.array([0.1, 0.5, 0.05, 0.15]), 0.2, 6)
NAMES = ("cup", "box", "<lid>", "lock")


def test_the_best_objects_come_first_then_all_others_then_unseen():
    rows = BELIEF.named(NAMES, shown=2).table().rows
    assert [row[0] for row in rows] == ["box", "lock", "2 others", "unseen (6 never met)"]
    assert [row[1].share for row in rows] == pytest.approx([0.5, 0.15, 0.15, 0.2])
    assert [str(row[1]) for row in rows] == ["0.500", "0.150", "0.150", "0.200"]


def test_entropy_and_verdict_are_said():
    assert f"entropy {BELIEF.entropy:.3f} nats; judged known, box" in str(BELIEF.named(NAMES))
    novel = IdentityBelief(np.array([0.4]), 0.6, 3)
    assert "judged novel" in str(novel.named(["cup"]))
    assert "judged novel" in str(IdentityBelief(np.array([]), 1.0, 3).named([]))


def test_probabilities_go_by_name():
    table = BELIEF.named(NAMES)
    assert (table["box"], table["<lid>"], table.unseen, len(table)) == (0.5, 0.05, 0.2, 4)
    assert list(table) == [("box", 0.5), ("lock", 0.15), ("cup", 0.1), ("<lid>", 0.05)]
    with pytest.raises(UnknownNameError, match="belief: unknown name 'pot'"):
        table["pot"]


def test_a_notebook_shows_names_as_they_are():
    assert "<lid>" in Reader(BELIEF.named(NAMES)._repr_html_()).texts


def test_a_belief_without_names_shows_indices():
    assert "object 1" in Reader(BELIEF._repr_html_()).texts


def test_an_engine_knows_the_names():
    assumptions = one_slot(3, 2, 3)
    memory = RobotMemory(assumptions, [graph(assumptions, "cup", [(0,)]), graph(assumptions, "box", [(1,)])])
    inference = trial("bayes-filter", memory, ModelParameters(0.0, 0.0), 0)
    table = inference.belief_table(shown=1)
    assert table["cup"] == inference.identity().objects[0] > table["box"]
    assert [row[0] for row in table.table().rows] == ["cup", "1 other", "unseen (1 never met)"]
    assert begin_trial("gtsam", memory, ModelParameters()).belief_table()["cup"] == pytest.approx(1 / 3)


@pytest.mark.parametrize(("names", "shown"), [(("cup",), 2), (NAMES, 0)])
def test_other_names_and_no_rows_are_refused(names, shown):
    with pytest.raises(InvalidInputError, match="expected"):
        BELIEF.named(names, shown)
