import pytest

from atg_fg.worlds.arcube import make_arcubes
from benchmarks.memories import (
    N_LEARNING_ACTIONS,
    course_for,
    equal_matches,
    matching_course,
    remembered,
    with_learned_structure,
)


@pytest.mark.parametrize("size", [1, 30])
def test_a_memory_has_the_objects_that_were_asked_for(size):
    memory = remembered(size)
    assert len(memory) == memory.assumptions.n_objects == size
    assert all(sum(graph.counts.values()) == N_LEARNING_ACTIONS for graph in memory)
    assert memory == remembered(size)


def test_the_trial_is_of_an_object_that_is_remembered():
    few, many = course_for(remembered(2), 5), course_for(remembered(9), 5)
    assert (few.patterns, few.actions) == (many.patterns, many.actions)
    assert [each.pattern for each in few.evidence] == list(few.patterns)
    assert (len(few.patterns), len(few.actions)) == (6, 5)
    cube = make_arcubes(1, seed=0)[0]
    symbols = remembered(2).assumptions.alphabet.patterns
    assert all(set(symbols[pattern]) <= set(cube) for pattern in few.patterns)


def test_the_same_number_of_objects_knows_what_is_seen():
    small, large = equal_matches(100), equal_matches(250)
    course = matching_course(small, 10)
    assert course.patterns == matching_course(large, 10).patterns
    for pattern in course.patterns:
        knowing = [sum(graph.aspect_showing(pattern) is not None for graph in memory) for memory in (small, large)]
        assert knowing[0] == knowing[1] > 0


def test_the_structured_memory_has_learned_a_structure():
    memory = with_learned_structure(10)
    (best, *_) = memory.learner.believed(memory.names)
    assert best.weight > 0.9
    assert best.followers.min() > 0.5
