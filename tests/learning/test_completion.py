import networkx
import numpy as np
import pytest

from atg_fg.core.errors import UnknownNameError
from atg_fg.learning.completion import OBSERVED, PREDICTED, UNKNOWN, completed_atg, statuses
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage.graph_export import view_to_dot, view_to_graphml
from atg_fg.worlds.arcube import SUCCESSORS, make_arcubes, shown_pattern
from tests.learning.test_structured_memory import add
from tests.learning.worlds import ARCUBES, cubes, random_objects, trial_of


@pytest.fixture(scope="module")
def memory():
    """Five cubes seen in ten actions each, and a sixth in two."""
    rng = np.random.default_rng(1)
    result = StructuredMemory(ARCUBES)
    for number, cube in enumerate(cubes(6)):
        add(result, trial_of(cube, 10 if number < 5 else 2, rng))
    return result


@pytest.mark.parametrize("number", range(6))
def test_what_is_predicted_is_true_of_the_cube_and_has_all_its_aspects(memory, number):
    name, cube = memory.names[number], make_arcubes(6, 0)[number]
    completed = completed_atg(memory, name)
    assert len(completed) == completed.graph["poses"] == 24
    assert completed.number_of_edges() == 72
    assert completed.graph["follows"] > 0.99
    true = {shown_pattern(cube, pose): pose for pose in range(24)}
    known = {node: pattern for node, pattern in completed.nodes(data="pattern") if pattern is not None}
    assert set(known.values()) <= set(true)
    for source, target, data in completed.edges(data=True):
        if source in known and target in known:
            action = ARCUBES.actions.index(data["action"])
            assert SUCCESSORS[true[known[source]]][action] == true[known[target]]


def test_what_was_observed_is_there_as_it_was_and_marked(memory):
    for graph in memory:
        completed = completed_atg(memory, graph.name)
        marked = [node for node, status in completed.nodes(data="status") if status == OBSERVED]
        assert [completed.nodes[node]["pattern"] for node in marked] == list(graph.aspects)
        assert all(len(completed.nodes[node]["poses"]) == 1 for node in marked)
        counts = {
            (source, ARCUBES.actions.index(data["action"]), target): data["count"]
            for source, target, data in completed.edges(data=True)
            if data["observed"]
        }
        assert counts == graph.counts


def test_what_was_hardly_seen_has_aspects_of_which_a_part_is_known(memory):
    completed = completed_atg(memory, memory.names[-1])
    numbers = statuses(completed)
    assert numbers[UNKNOWN] > 0
    assert sum(numbers.values()) == 24
    for _, data in completed.nodes(data=True):
        if data["status"] == UNKNOWN:
            assert data["pattern"] is None
            assert None in data["symbols"]
        else:
            assert data["symbols"] == data["pattern"]
        assert 0 < data["probability"] <= 1


def test_the_probability_is_that_of_the_structure_times_that_of_the_pattern(memory):
    believed = [each._replace(weight=0.5 * each.weight) for each in memory.learner.believed(memory.names)]
    half, whole = completed_atg(memory, "object-000", believed), completed_atg(memory, "object-000")
    for node, data in whole.nodes(data=True):
        factor = 1.0 if data["status"] == OBSERVED else 0.5
        assert half.nodes[node]["probability"] == pytest.approx(factor * data["probability"])
    slip = memory.learner.rates.slip
    for _, _, data in half.edges(data=True):
        expected = 1.0 if data["observed"] else half.graph["follows"] * (1 - slip)
        assert data["probability"] == pytest.approx(expected)


def test_where_no_structure_is_believed_only_what_was_observed_is_there():
    rng = np.random.default_rng(0)
    memory = StructuredMemory(ARCUBES)
    for each in random_objects(3, rng):
        add(memory, trial_of(each, 10, rng))
    completed = completed_atg(memory, "object-001")
    assert statuses(completed)[OBSERVED] == memory["object-001"].n_known
    assert not any(p > 1e-3 for _, p in completed.nodes(data="probability") if p < 1)


def test_an_unknown_object_is_refused(memory):
    with pytest.raises(UnknownNameError, match="cup"):
        completed_atg(memory, "cup")


def test_other_tools_read_it(memory):
    completed = completed_atg(memory, memory.names[-1])
    slots = ARCUBES.alphabet.slots
    read = networkx.parse_graphml(view_to_graphml(completed, slots), force_multigraph=True)
    assert (len(read), read.number_of_edges()) == (24, 72)
    assert {status for _, status in read.nodes(data="status")} == {OBSERVED, PREDICTED, UNKNOWN}
    dot = view_to_dot(completed, slots)
    assert '"pose-' in dot
    assert "front ?" in dot
    assert dot.count("->") == 72
