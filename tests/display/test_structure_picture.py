import io

import networkx
import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.display.completed_picture import draw_completed_atg, probability_text
from atg_fg.display.ring_layout import ring_layout
from atg_fg.display.structure_picture import draw_structure
from atg_fg.display.structure_words import action_text, copies, cycles, lost, register_names
from atg_fg.learning.completion import completed_atg
from atg_fg.learning.structured_memory import StructuredMemory
from tests.learning.test_structured_memory import add
from tests.learning.worlds import ARCUBES, BOX, CUBE, RING, RING_WORLD, cubes, trial_of


@pytest.fixture(scope="module")
def memory():
    rng = np.random.default_rng(1)
    result = StructuredMemory(ARCUBES)
    for cube in cubes(5):
        add(result, trial_of(cube, 9, rng))
    return result


def drawn(figure):
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=40)
    return buffer.getvalue()


def arrows(figure):
    """Solid and dashed arrows."""
    from matplotlib.patches import FancyArrowPatch

    patches = [patch for axes in figure.axes for patch in axes.patches if isinstance(patch, FancyArrowPatch)]
    solid = [patch for patch in patches if patch.get_linestyle() in ("-", "solid")]
    return len(solid), len(patches) - len(solid)


def test_observed_and_predicted_transitions_are_drawn_apart(memory):
    graph = completed_atg(memory, "object-000")
    figure = draw_completed_atg(graph, ARCUBES)
    n_observed = len(memory["object-000"].counts)
    assert arrows(figure) == (n_observed, 72 - n_observed)
    texts = [text.get_text() for text in figure.axes[0].texts]
    assert ("?" in texts) == any(status == "unknown" for _, status in graph.nodes(data="status"))
    assert drawn(figure) == drawn(draw_completed_atg(graph, ARCUBES))


def test_the_probability_of_most_predicted_aspects_is_said_once_and_others_at_theirs(memory):
    graph = completed_atg(memory, "object-000")
    predicted = [data for _, data in graph.nodes(data=True) if data["status"] == "predicted"]
    for data in predicted:
        data["probability"] = 0.97
    predicted[0]["probability"] = 0.71
    figure = draw_completed_atg(graph, ARCUBES)
    assert [text.get_text() for text in figure.axes[0].texts if text.get_text().startswith("p ")] == ["p 0.71"]
    (legend,) = figure.legends
    assert any("aspects p 0.97" in text.get_text() for text in legend.get_texts())


def test_no_two_aspects_are_drawn_at_the_same_place(memory):
    places = np.array(list(ring_layout(completed_atg(memory, "object-001"), ARCUBES.actions).values()))
    distances = np.hypot(*(places[:, None] - places).T) + 9 * np.eye(24)
    assert distances.min() > 1.5


def test_graphs_that_are_no_rings_are_drawn_too():
    graph = networkx.MultiDiGraph(name="chain", follows=0.0, poses=0)
    for node in range(12):
        graph.add_node(node, status="observed", pattern=(node, 0), symbols=(node, 0), probability=1.0, poses=())
    for node in range(11):
        graph.add_edge(node, node + 1, action="flip", observed=True, count=1, probability=1.0)
    graph.add_edge(0, 0, action="left", observed=True, count=1, probability=1.0)
    assert drawn(draw_completed_atg(graph, ARCUBES)).startswith(b"\x89PNG")
    assert len(ring_layout(graph, ARCUBES.actions)) == 12


def test_a_graph_without_aspects_is_refused():
    with pytest.raises(InvalidInputError, match="no aspect"):
        draw_completed_atg(networkx.MultiDiGraph(name="nothing"), ARCUBES)


def test_certainty_is_not_claimed_where_there_is_none():
    assert [probability_text(p) for p in (1.0, 0.9999, 0.99, 0.25)] == ["1.00", "> 0.99", "0.99", "0.25"]


def test_every_move_of_a_content_is_an_arrow():
    moves = sum(register != source for sources in CUBE.sources for register, source in enumerate(sources))
    figure = draw_structure(CUBE, ARCUBES)
    assert arrows(figure) == (moves, 0)
    assert drawn(figure) == drawn(draw_structure(CUBE, ARCUBES))
    assert drawn(draw_structure(RING, RING_WORLD)).startswith(b"\x89PNG")


def test_structures_in_words():
    names = register_names(RING, RING_WORLD.alphabet.slots)
    assert names == ("left", "right", "c3")
    assert action_text(RING.sources[0], names) == "left ← right, right ← c3, c3 ← left"
    assert action_text(RING.sources[1], names) == "left ← right, right ← left"
    assert action_text((0, 1, 2), names) == "nothing moves"
    assert cycles(RING.sources[0]) == [[0, 2, 1]]
    assert cycles((1, 0, 2, 4, 5, 3)) == [[3, 5, 4], [0, 1]]


def test_irreversible_actions_in_words():
    assert action_text((2, 1, 2), ("front", "top", "c3")) == "front ← c3; lost: front"
    assert action_text((1, 1, 1), ("front", "top", "c3")) == "front ← top, c3 ← top; lost: front, c3"
    # Two contents go round, one is copied from there, one is lost.
    assert (cycles((1, 0, 0)), copies((1, 0, 0)), lost((1, 0, 0))) == ([[0, 1]], [(0, 2)], [2])
    assert (cycles((1, 2, 2)), copies((1, 2, 2)), lost((1, 2, 2))) == ([], [(1, 0), (2, 1)], [0])
    assert (copies(RING.sources[0]), lost(RING.sources[0])) == ([], [])


def test_what_is_copied_and_what_is_lost_is_drawn():
    figure = draw_structure(BOX, RING_WORLD)
    texts = [text.get_text() for text in figure.axes[0].texts]
    (said,) = [text for text in texts if "lost" in text]
    assert "→ right" in said
    assert "lost: right" in said
    frames = [text.get_bbox_patch() for text in figure.axes[0].texts if text.get_bbox_patch() is not None]
    assert [frame.get_linestyle() for frame in frames].count("dashed") == 1
    assert drawn(figure).startswith(b"\x89PNG")
