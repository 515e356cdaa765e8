import numpy as np

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.experiments.exploration import complete_memory, learned_memory
from atg_fg.policies import ExplorationPolicy, RandomPolicy
from atg_fg.worlds.arcube import SUCCESSORS, make_arcubes, shown_pattern

ASSUMPTIONS = arcube_assumptions()
CUBES = make_arcubes(4, seed=0)


def test_a_complete_memory_knows_every_aspect_and_every_transition():
    memory = complete_memory(ASSUMPTIONS, CUBES)
    assert memory.names == ("object-000", "object-001", "object-002", "object-003")
    for cube, graph in zip(CUBES, memory, strict=True):
        assert graph.aspects == tuple(shown_pattern(cube, orientation) for orientation in range(24))
        assert graph.counts == {(x, a, y): 1 for x, row in enumerate(SUCCESSORS) for a, y in enumerate(row)}


def test_a_learned_memory_has_an_atg_a_cube_of_what_its_trial_showed():
    memory = learned_memory(ASSUMPTIONS, CUBES, RandomPolicy(), 20, np.random.default_rng(0))
    complete = complete_memory(ASSUMPTIONS, CUBES)
    for graph, whole in zip(memory, complete, strict=True):
        assert sum(graph.counts.values()) == 20
        assert set(graph.aspects) <= set(whole.aspects)
        to_whole = [whole.aspects.index(pattern) for pattern in graph.aspects]
        assert all((to_whole[x], a, to_whole[y]) in whole.counts for x, a, y in graph.counts)


def test_the_same_generator_gives_the_same_memory():
    first, second, other = (
        learned_memory(ASSUMPTIONS, CUBES, ExplorationPolicy(), 6, np.random.default_rng(seed)) for seed in (0, 0, 1)
    )
    assert first == second != other
