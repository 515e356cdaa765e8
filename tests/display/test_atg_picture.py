import io

import numpy as np
import pytest

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions, arcube_assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import PatternAlphabet
from atg_fg.display.atg_picture import draw_atg
from atg_fg.worlds.arcube import SUCCESSORS, make_arcubes, shown_pattern


def explored(n_actions):
    """The ATG of a cube turned at random, slipping now and then."""
    graph = AspectTransitionGraph("cube", arcube_assumptions())
    (cube,) = make_arcubes(1, seed=0)
    rng = np.random.default_rng(n_actions)
    orientations, actions = [0], rng.integers(3, size=n_actions).tolist()
    for action in actions:
        here = orientations[-1]
        orientations.append(here if rng.random() < 0.1 else SUCCESSORS[here][action])
    alphabet = graph.assumptions.alphabet
    graph.learn([alphabet.index(shown_pattern(cube, orientation)) for orientation in orientations], actions)
    return graph


def drawn(figure):
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=40)
    return buffer.getvalue()


def texts(figure):
    return [text.get_text() for text in figure.axes[0].texts]


def arrows(figure):
    """Solid and dotted arrows between aspects and to the collection node."""
    from matplotlib.patches import FancyArrowPatch

    patches = [patch for patch in figure.axes[0].patches if isinstance(patch, FancyArrowPatch)]
    solid = [patch for patch in patches if patch.get_linestyle() in ("-", "solid")]
    return len(solid), len(patches) - len(solid)


@pytest.mark.parametrize("n_actions", [1, 6, 40, 300])
def test_every_known_and_every_unknown_edge_is_drawn(n_actions):
    graph = explored(n_actions)
    figure = draw_atg(graph)
    loops = sum(source == target for source, _, target in graph.counts)
    dotted = len(list(graph.unknown_transitions())) if graph.n_unobserved else 0
    assert arrows(figure) == (len(graph.counts) - loops, dotted)
    assert drawn(figure).startswith(b"\x89PNG")


def test_the_collection_node_says_how_many_aspects_are_unobserved():
    assert "collection node\n22 unobserved aspects" in texts(draw_atg(explored(1)))


def test_a_complete_graph_has_no_collection_node():
    graph = explored(600)
    assert graph.n_unobserved == 0
    assert not any("collection" in text for text in texts(draw_atg(graph)))


def test_tags_are_drawn_on_the_faces_where_there_are_images():
    graph = explored(4)
    images = {symbol: np.full((7, 7), 20 * symbol, dtype=np.uint8) for symbol in range(12)}
    assert len(draw_atg(graph, symbol_images=images).axes[0].images) == 2 * graph.n_known
    assert len(draw_atg(graph).axes[0].images) == 0


def test_other_slots_are_tiles_with_names():
    assumptions = Assumptions(3, 4, ("push",), PatternAlphabet(("colour", "shape", "sound"), 4))
    graph = AspectTransitionGraph("bell", assumptions)
    graph.add_aspect((0, 1, 2))
    graph.add_transition(0, 0, 0, 3)
    found = texts(draw_atg(graph))
    assert {"colour", "shape", "sound", "0", "1", "2", "×3"} <= set(found)


def test_the_same_graph_gives_the_same_picture():
    assert drawn(draw_atg(explored(9), highlight=1)) == drawn(draw_atg(explored(9), highlight=1))
    assert drawn(draw_atg(explored(9), highlight=1)) != drawn(draw_atg(explored(9)))


@pytest.mark.parametrize("highlight", [-1, 99])
def test_an_aspect_that_is_not_there_cannot_be_highlighted(highlight):
    with pytest.raises(
        InvalidInputError, match=f"highlight, a known aspect: {highlight}; expected a whole number from 0 to"
    ):
        draw_atg(explored(4), highlight=highlight)


def test_a_path_is_drawn_strong_and_the_other_transitions_pale():
    from matplotlib.patches import FancyArrowPatch

    graph = explored(6)
    edges = [edge for edge in graph.counts if edge[0] != edge[2]]
    patches = [patch for patch in draw_atg(graph, path=edges[:2]).axes[0].patches if isinstance(patch, FancyArrowPatch)]
    solid = [patch for patch in patches if patch.get_linestyle() in ("-", "solid")]
    assert sorted(patch.get_alpha() or 1.0 for patch in solid) == [0.4] * (len(edges) - 2) + [1.0] * 2


def test_a_path_that_was_never_seen_is_refused():
    with pytest.raises(InvalidInputError, match=r"path: transition \(0, 0, 9\)"):
        draw_atg(explored(6), path=[(0, 0, 9)])
