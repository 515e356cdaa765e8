import io

import networkx
import pytest

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.patterns import PatternAlphabet
from atg_fg.storage.graph_export import view_to_dot, view_to_graphml


@pytest.fixture
def graph():
    assumptions = Assumptions(3, 4, ('say "hi"', "pull"), PatternAlphabet(("front", "top"), 4))
    result = AspectTransitionGraph('a <cup> & "saucer"', assumptions)
    for pattern in ((0, 1), (1, 2)):
        result.add_aspect(pattern)
    result.add_transition(0, 0, 1, 3)
    result.add_transition(1, 1, 1)
    return result


def test_graphml_is_read_back_with_every_edge_and_count(graph):
    read = networkx.read_graphml(
        io.BytesIO(view_to_graphml(graph.to_networkx(), graph.assumptions.alphabet.slots).encode()),
        force_multigraph=True,
    )
    view = graph.to_networkx()
    assert (read.number_of_nodes(), read.number_of_edges()) == (3, view.number_of_edges())
    counts = sorted(count for _, _, count in read.edges(data="count"))
    assert counts == [0, 0, 1, 3]
    assert sorted(observed for *_, observed in read.edges(data="observed")) == [False, False, True, True]


def test_dot_shows_observed_edges_solid_and_unknown_ones_dotted(graph):
    dot = view_to_dot(graph.to_networkx(), graph.assumptions.alphabet.slots)
    assert dot.startswith("digraph")
    assert dot.count("->") == 4
    assert dot.count("dotted") == 2
    assert "2 unobserved" in dot
    assert '\\"saucer\\"' in dot
    assert dot.count("{") == dot.count("}")


def test_a_complete_graph_has_no_collection_node_to_export():
    assumptions = Assumptions(1, 1, ("push",), PatternAlphabet(("front",), 1))
    graph = AspectTransitionGraph("dot", assumptions)
    graph.add_aspect((0,))
    for write in (view_to_dot, view_to_graphml):
        assert "collection" not in write(graph.to_networkx(), assumptions.alphabet.slots)
