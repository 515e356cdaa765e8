import os
import sys

import numpy as np
import pytest

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.errors import InvalidInputError, MissingDependencyError
from atg_fg.core.memory import RobotMemory
from atg_fg.display import figures
from atg_fg.display.atg_picture import draw_atg
from atg_fg.display.success_plots import plot_success
from atg_fg.display.trial_plots import course_of, plot_atg, plot_belief, plot_entropy
from atg_fg.engines import begin_trial
from atg_fg.experiments.scores import TestResult
from atg_fg.experiments.trial import run_trial
from atg_fg.policies import make_policy
from atg_fg.storage.presets import preset
from atg_fg.worlds.registry import make_world

NAMES = ("cup", "box")
BELIEFS = [
    IdentityBelief(np.array([0.1, 0.2]), 0.7, 5),
    IdentityBelief(np.array([0.05, 0.9]), 0.05, 5),
]
POINTS = [
    {"actions": actions, "policy": policy, "success": success, "interval95": [success - 0.1, success + 0.1]}
    for policy, success in (("entropy", 0.8), ("random", 0.5))
    for actions in (4, 5)
]


def belief():
    return plot_belief(BELIEFS, NAMES)


def entropy():
    expected = [{"flip": 0.9, "left": 0.5}]
    return plot_entropy([b.entropy for b in BELIEFS], expected, ["left"])


def success():
    return plot_success(POINTS, title="Figure 3")


def words(figure):
    axes = figure.axes[0]
    legends = [text.get_text() for legend in (axes.get_legend(), *figure.legends) if legend for text in legend.texts]
    return " ".join([axes.get_title(loc="left"), *(text.get_text() for text in axes.texts), *legends])


#: Plots with their words; each in one format, and in the others where slow tests run.
SAVED = {
    "png": (belief, ["cup", "box", "unseen", "novel"]),
    "svg": (entropy, ["flip", "left", "chosen"]),
    "pdf": (success, ["entropy", "random", "Figure 3"]),
}


@pytest.mark.parametrize(
    ("plot", "expected", "suffix"),
    [
        pytest.param(*shown, suffix, marks=[pytest.mark.slow] if suffix != usual else [])
        for usual, shown in SAVED.items()
        for suffix in SAVED
    ],
)
def test_every_plot_is_saved_with_its_words_and_the_same_bytes_each_time(plot, expected, suffix, tmp_path):
    figure = plot()
    assert all(word in words(figure) for word in expected)
    for name in ("one", "other"):
        figures.save_figure(plot(), tmp_path / f"{name}.{suffix}")
    assert (tmp_path / f"one.{suffix}").read_bytes() == (tmp_path / f"other.{suffix}").read_bytes()


def test_a_figure_shows_itself_in_a_notebook():
    assert belief()._repr_png_().startswith(b"\x89PNG")


def test_an_image_is_saved_as_it_is(tmp_path):
    from matplotlib.image import imread

    image = np.random.default_rng(0).integers(256, size=(4, 5, 3), dtype=np.uint8)
    figures.save_image(image, tmp_path / "image.png")
    np.testing.assert_array_equal(np.round(imread(tmp_path / "image.png")[:, :, :3] * 255), image)


@pytest.mark.parametrize("name", ["figure.jpeg", "figure", "no/folder/figure.png"])
def test_a_path_that_cannot_hold_a_figure_is_refused(name, tmp_path):
    with pytest.raises(InvalidInputError, match=r"expected"):
        figures.save_figure(belief(), tmp_path / name)
    assert os.listdir(tmp_path) == []


def test_without_matplotlib_the_extra_that_brings_it_is_named(monkeypatch):
    figures.figure_class.cache_clear()
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(MissingDependencyError, match=r"atg-fg\[viz\]"):
        belief()


@pytest.mark.parametrize(
    "plot",
    [
        lambda: plot_belief([], NAMES),
        lambda: plot_belief(BELIEFS, ["cup"]),
        lambda: plot_entropy([], [], []),
        lambda: plot_success([]),
    ],
)
def test_nothing_to_draw_is_refused(plot):
    with pytest.raises(InvalidInputError):
        plot()


@pytest.fixture(scope="module")
def trial():
    """A record, and the engine at the end of the same trial, of a cube that is remembered."""
    memory = RobotMemory(arcube_assumptions())
    with make_world("ideal") as world:
        for seed, policy in enumerate(("explore", "entropy")):
            inference = begin_trial("bayes-filter", memory, preset("default"))
            rng = np.random.default_rng(seed)
            record = run_trial(world, inference, make_policy(policy), 8, rng, reset_options={"object": 3})
            if seed == 0:
                memory.learn(record.patterns, record.actions, None)
    return record, inference


def png(figure):
    return figure._repr_png_()


@pytest.mark.parametrize("plot", [plot_belief, plot_entropy, plot_atg])
def test_a_record_and_its_engine_give_the_same_picture(plot, trial):
    record, inference = trial
    assert png(plot(record)) == png(plot(inference))


def test_a_trial_is_drawn_as_its_beliefs_and_entropies_are(trial):
    record, _ = trial
    beliefs = [step.belief for step in record.steps]
    assert png(plot_belief(record)) == png(plot_belief(beliefs, record.names))
    names = record.assumptions.actions
    expected = [dict(zip(names, step.expected_entropies, strict=True)) for step in record.steps[:-1]]
    chosen = [names[action] for action in record.actions]
    assert png(plot_entropy(record)) == png(plot_entropy([belief.entropy for belief in beliefs], expected, chosen))


def test_the_atg_of_a_trial_is_what_it_alone_showed(trial):
    record, _ = trial
    graph = AspectTransitionGraph("what the trial showed", record.assumptions)
    graph.learn(record.patterns, record.actions)
    last = graph.aspect_showing(record.patterns[-1])
    assert png(plot_atg(record)) == png(draw_atg(graph, highlight=last))
    assert png(plot_atg(graph)) == png(draw_atg(graph)) != png(plot_atg(record))
    assert png(plot_atg(record, highlight=None)) == png(plot_atg(graph))


def test_an_engine_with_options_is_gone_through_with_them_once_more(trial):
    memory = trial[1].memory
    inference = begin_trial("particle", memory, preset("default"), n_particles=50, seed=3)
    for number, look in enumerate(trial[1].history.evidence[:3]):
        inference.observe(look)
        if number < 2:
            inference.act(trial[1].history.actions[number])
    beliefs = course_of(inference).beliefs
    assert len(beliefs) == 3
    np.testing.assert_array_equal(beliefs[-1].probabilities, inference.identity().probabilities)


def test_an_engine_whose_memory_has_learned_since_is_refused(trial):
    record, engine = trial
    memory = engine.memory.copy()
    inference = begin_trial("bayes-filter", memory, preset("default"))
    inference.observe(engine.history.evidence[0])
    memory.learn(record.patterns, record.actions, None)
    with pytest.raises(InvalidInputError, match="the memory has learned since it began"):
        plot_belief(inference)


TESTS = [TestResult(0, (9, 10), (3, 4), (8, 10)), TestResult(1, (10, 10), (0, 0), (10, 10))]


def test_tests_are_drawn_as_scores_with_their_intervals():
    figure = plot_success(TESTS)
    # Wilson, by hand: 19 of 20, 3 of 4, 18 of 20.
    assert [text.get_text() for text in figure.axes[0].texts] == [
        "95.0 (76.4–99.1)",
        "75.0 (30.1–95.4)",
        "90.0 (69.9–97.2)",
    ]
    assert [bar.get_width() for bar in figure.axes[0].patches] == pytest.approx([95, 75, 90])


def test_named_tests_are_drawn_side_by_side():
    figure = plot_success({"ours": TESTS, "$theirs$": TESTS[1:]}, title="Compared")
    axes = figure.axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()] == ["ours", "$theirs$"]
    assert [bar.get_width() for bar in axes.patches] == pytest.approx([90, 100])
    assert axes.get_title(loc="left") == "Compared"


@pytest.mark.parametrize(
    "plot",
    [
        lambda: plot_belief(BELIEFS),
        lambda: plot_success({}),
        lambda: plot_success({"ours": []}),
        lambda: plot_success(["a test"]),
        lambda: plot_atg(begin_trial("gtsam", RobotMemory(arcube_assumptions()), preset("default"))),
        lambda: plot_entropy(begin_trial("gtsam", RobotMemory(arcube_assumptions()), preset("default"))),
    ],
)
def test_what_cannot_be_drawn_is_refused(plot):
    with pytest.raises(InvalidInputError, match="expected"):
        plot()


def test_a_trial_has_its_own_expectations(trial):
    with pytest.raises(InvalidInputError, match="expected, chosen: given with a trial"):
        plot_entropy(trial[0], [{}], ["flip"])


@pytest.mark.parametrize(
    "plot", [lambda: plot_success(TESTS), lambda: plot_atg(AspectTransitionGraph("new", arcube_assumptions()))]
)
def test_every_plot_names_the_extra_where_matplotlib_is_missing(plot, monkeypatch):
    figures.figure_class.cache_clear()
    monkeypatch.setitem(sys.modules, "matplotlib.figure", None)
    with pytest.raises(MissingDependencyError, match=r"atg-fg\[viz\]"):
        plot()
