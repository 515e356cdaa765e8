import numpy as np
import pytest

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.errors import UnknownNameError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import Evidence
from atg_fg.engines import begin_trial
from atg_fg.inference.expected_entropy import best_actions
from atg_fg.policies import EntropyPolicy, RandomPolicy, make_policy
from atg_fg.storage.presets import preset
from atg_fg.worlds.arcube import SUCCESSORS, make_arcubes, shown_pattern


def looking_at(cube_number, *, remembered):
    """An engine after one look, with the first cubes in memory, each flipped once from upright."""
    memory = RobotMemory(arcube_assumptions())
    cubes = make_arcubes(remembered + 1, seed=0)
    for cube in cubes[:remembered]:
        shown = [shown_pattern(cube, 0), shown_pattern(cube, SUCCESSORS[0][0])]
        memory.learn([memory.assumptions.alphabet.index(pattern) for pattern in shown], [0], matched=None)
    inference = begin_trial("bayes-filter", memory, preset("default"))
    inference.observe(Evidence.of_detection(memory.assumptions.alphabet, shown_pattern(cubes[cube_number], 0)))
    return inference


def test_the_entropy_policy_tries_the_action_it_knows_to_tell_objects_apart():
    choice = EntropyPolicy().choose(looking_at(0, remembered=1), np.random.default_rng(0))
    assert choice.action == 0
    assert choice.expected_entropies[0] < choice.expected_entropies[1]


def test_ties_are_broken_at_random_and_alike_for_the_same_generator():
    inference = looking_at(0, remembered=0)
    chosen = [EntropyPolicy().choose(inference, np.random.default_rng(seed)).action for seed in range(40)]
    assert set(chosen) == {0, 1, 2}
    assert chosen == [EntropyPolicy().choose(inference, np.random.default_rng(seed)).action for seed in range(40)]


def test_a_billionth_of_a_nat_is_a_tie():
    assert best_actions(np.array([1.0, 1.0 + 9e-10, 1.0 + 2e-9])) == [0, 1]


def test_the_random_policy_takes_every_action_as_often():
    inference, rng = looking_at(0, remembered=1), np.random.default_rng(0)
    counts = np.bincount([RandomPolicy().choose(inference, rng).action for _ in range(3000)], minlength=3)
    assert abs(counts - 1000).max() < 4 * np.sqrt(3000 * 2 / 9)


def test_an_unknown_policy_is_refused():
    with pytest.raises(
        UnknownNameError,
        match="'greedy'; expected one of: entropy, explore, lookahead-2, lookahead-2-pruned, lookahead-3, random",
    ):
        make_policy("greedy")
