"""Figures of one trial: belief and entropy, action by action, and the ATG that it shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from atg_fg.core.actions import AnyAction, told
from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.checks import finite_array, instance, number, one_of, plain_text, sequence, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray
from atg_fg.core.records import TrialRecord
from atg_fg.display.atg_picture import draw_atg
from atg_fg.display.figures import GREY, INK, PALETTE, plot_style
from atg_fg.display.plot_parts import LineEnd, figure_with_axes, label_ends, legend_above, step_axis
from atg_fg.engines import begin_trial
from atg_fg.inference.interface import Inference

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D


class TrialCourse(NamedTuple):
    """A trial of t actions, with t + 1 looks or, if the last one is still to come or the object was lost, t.

    Attributes:
        assumptions: What the trial took for granted.
        names: Of the remembered objects.
        beliefs: After each look.
        patterns: Index of the pattern seen at each look, ``None`` where it was not complete.
        actions: Index of each action that a look followed.
        expected: Expected entropy in nats of each action, by name, before each of ``actions``; empty where the policy
            did not ask.
    """

    assumptions: Assumptions
    names: tuple[str, ...]
    beliefs: list[IdentityBelief]
    patterns: list[int | None]
    actions: list[AnyAction]
    expected: list[Mapping[str, float]]

    @property
    def chosen(self) -> list[str]:
        """Name of each action that a look followed."""
        return [told(action, self.assumptions) for action in self.actions]


def course_of(trial: TrialRecord | Inference) -> TrialCourse:
    """Return how a trial went.

    An engine does not keep what it believed before, so the trial is gone through once more with another one like it.

    Raises:
        InvalidInputError: There was no look yet, or the memory has learned since the engine's trial began.
    """
    course = _of_record(trial) if isinstance(trial, TrialRecord) else _of_inference(instance(trial, "trial", Inference))
    if not course.beliefs:
        raise InvalidInputError("trial: nothing seen yet; expected a first look")
    return course


def _of_record(record: TrialRecord) -> TrialCourse:
    steps, assumptions = record.steps, record.assumptions
    # The last action of a trial in which the object was lost has no look after it.
    followed = steps[:-1]
    actions: list[AnyAction] = [step.action for step in followed if step.action is not None]
    expected = [_by_name(assumptions, step.expected_entropies) for step in followed]
    return TrialCourse(assumptions, record.names, [step.belief for step in steps], record.patterns, actions, expected)


def _of_inference(inference: Inference) -> TrialCourse:
    memory, evidence, actions = inference.memory, inference.history.evidence, inference.history.actions
    again = begin_trial(type(inference), memory, inference.parameters, inference.prior, **inference.options)
    beliefs, expected = [], []
    for time, look in enumerate(evidence):
        again.observe(look)
        beliefs.append(again.identity())
        if time < len(actions):
            if time + 1 < len(evidence):
                expected.append(_by_name(memory.assumptions, again.expected_entropies()))
            again.act(actions[time])
    before, now = inference.identity().probabilities, again.identity().probabilities
    # An engine that samples may have been asked at other times, and have sampled other things then.
    if before.shape != now.shape or (inference.exact and not np.allclose(before, now, atol=1e-6)):
        raise InvalidInputError(
            "trial: the memory has learned since it began; expected the memory as it was then, or the trial's record"
        )
    patterns = [look.pattern for look in evidence]
    return TrialCourse(
        memory.assumptions, memory.names, beliefs, patterns, actions[: max(len(evidence) - 1, 0)], expected
    )


def _by_name(assumptions: Assumptions, entropies: FloatArray | None) -> Mapping[str, float]:
    return {} if entropies is None else dict(zip(assumptions.actions, entropies.tolist(), strict=True))


def plot_atg(shown: AspectTransitionGraph | TrialRecord | Inference, **options: Any) -> Figure:
    """Draw an ATG like the paper's Figure 1.

    Args:
        shown: An ATG; or a trial, for the ATG of what it alone has shown, with the last aspect framed.
        options: Keyword arguments of ``draw_atg``: ``symbol_images``, ``highlight``, ``path``.

    Raises:
        InvalidInputError: As for ``draw_atg``.
        MissingDependencyError: matplotlib is not installed.
    """
    if isinstance(shown, AspectTransitionGraph):
        return draw_atg(shown, **options)
    course = course_of(shown)
    graph = AspectTransitionGraph("what the trial showed", course.assumptions)
    graph.learn(course.patterns, [action if isinstance(action, int) else None for action in course.actions])
    last = course.patterns[-1]
    highlight = None if last is None else graph.aspect_showing(last)
    return draw_atg(graph, **{"highlight": highlight, **options})


def plot_belief(
    trial: TrialRecord | Inference | Sequence[IdentityBelief], names: Sequence[str] | None = None, *, top: int = 5
) -> Figure:
    """Plot who the object may be, action by action.

    Args:
        trial: A trial; or the belief after each observation, the first before any action, length t + 1.
        names: Name of each remembered object, length K; those of the trial if not given.
        top: Draw this many objects at most: those whose final plus peak probability is highest.

    Raises:
        InvalidInputError: No beliefs, a belief over another number of objects, beliefs without names, or ``top`` below
            one.
        MissingDependencyError: matplotlib is not installed.
    """
    if isinstance(trial, (TrialRecord, Inference)):
        course = course_of(trial)
        beliefs: Sequence[IdentityBelief] = course.beliefs
        names = course.names if names is None else names
    else:
        beliefs = sequence(trial, "beliefs")
    if names is None:
        raise InvalidInputError("names: none given with beliefs; expected one for each remembered object")
    _check_beliefs(beliefs, sequence(names, "names"), top)
    steps = np.arange(len(beliefs))
    objects = np.array([belief.objects for belief in beliefs]).reshape(len(beliefs), len(names))
    unseen = np.array([belief.unseen for belief in beliefs])
    order = np.argsort(-(objects[-1] + objects.max(axis=0)), kind="stable")[:top]
    with plot_style():
        figure, axes = figure_with_axes(7.2, 3.9)
        axes.axhline(0.5, color=GREY, linewidth=1, linestyle=(0, (2, 2)), zorder=1)
        ends = [
            LineEnd(float(unseen[-1]), f"unseen {unseen[-1]:.2f}", INK, "bold italic"),
            LineEnd(0.5, "novel if unseen is above", GREY, "small"),
        ]
        for rank, index in enumerate(order):
            color = PALETTE[rank % len(PALETTE)]
            dashes = "solid" if rank < len(PALETTE) else "dashed"
            axes.plot(steps, objects[:, index], color=color, linestyle=dashes, marker="o", markersize=3.5)
            ends.append(LineEnd(float(objects[-1, index]), f"{names[index]} {objects[-1, index]:.2f}", color))
        axes.plot(steps, unseen, color=INK, linewidth=2.6, marker="o", markersize=4)
        axes.set(ylim=(-0.02, 1.02), ylabel="probability")
        step_axis(axes, len(beliefs))
        label_ends(axes, ends)
        axes.set_title("Belief over identity")
    return figure


def plot_entropy(
    trial: TrialRecord | Inference | Sequence[float],
    expected: Sequence[Mapping[str, float]] = (),
    chosen: Sequence[str] = (),
) -> Figure:
    """Plot H(O) after each action beside what the planner expected of every action.

    Args:
        trial: A trial, and then nothing else; or H(O) in nats after each observation, the first before any action,
            length t + 1.
        expected: Expected entropy in nats of each action before it was taken, by name, length t; a policy
            that does not plan has an empty mapping.
        chosen: Name of the action taken, length t.

    Raises:
        InvalidInputError: Lengths that do not fit, or a chosen action nothing was expected of.
        MissingDependencyError: matplotlib is not installed.
    """
    if isinstance(trial, (TrialRecord, Inference)):
        if expected or chosen:
            raise InvalidInputError("expected, chosen: given with a trial; expected none, since the trial has its own")
        course = course_of(trial)
        entropies: Sequence[float] = [belief.entropy for belief in course.beliefs]
        expected, chosen = course.expected, course.chosen
    else:
        entropies = finite_array(trial, "entropies", (None,), "a number for each look").tolist()
    _check_entropies(entropies, expected, chosen)
    actions = list(dict.fromkeys(action for options in expected for action in options))
    with plot_style():
        figure, axes = figure_with_axes(7.8, 4.1)
        handles = axes.plot(range(len(entropies)), entropies, color="#555555", marker="o", markersize=4)
        for rank, action in enumerate(actions):
            handles += _plot_expected(axes, rank, len(actions), action, expected, chosen)
        handles += axes.plot([], [], "o", markersize=7, color=GREY) if actions else ()
        axes.set(ylabel="entropy (nats)")
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
        step_axis(axes, len(entropies))
        legend_above(axes, ["entropy H(O)", *actions, *["chosen (filled)"] * bool(actions)], handles)
        axes.set_title("Entropy of identity, and what each action was expected to leave", pad=28)
    return figure


def _plot_expected(
    axes: Axes, rank: int, n_actions: int, action: str, expected: Sequence[Mapping[str, float]], chosen: Sequence[str]
) -> list[Line2D]:
    """Mark what one action was expected to leave, just left of its outcome and apart from the others.

    The marks of where it was not taken are returned, for the legend.
    """
    color, shape = PALETTE[rank % len(PALETTE)], "s^Dvp*"[rank % 6]
    shift = 0.16 + 0.5 * (n_actions - 1 - rank) / max(n_actions, 3)
    lines: list[Line2D] = []
    for taken in (False, True):
        steps = [t for t, options in enumerate(expected) if action in options and (chosen[t] == action) == taken]
        lines += axes.plot(
            [t + 1 - shift for t in steps], [expected[t][action] for t in steps], shape, zorder=4,
            markersize=7 if taken else 5, markeredgecolor=color, markerfacecolor=color if taken else "white",
        )  # fmt: skip
    return lines[:1]


def _check_beliefs(beliefs: Sequence[IdentityBelief], names: Sequence[str], top: int) -> None:
    if not len(beliefs):
        raise InvalidInputError("beliefs: none given; expected at least one")
    for name in names:
        plain_text(name, "names")
    for step, belief in enumerate(beliefs):
        if len(instance(belief, f"beliefs[{step}]", IdentityBelief).objects) != len(names):
            raise InvalidInputError(
                f"beliefs[{step}]: {len(belief.objects)} objects; expected one for each of {len(names)} names"
            )
    whole_number(top, "top", least=1)


def _check_entropies(
    entropies: Sequence[float], expected: Sequence[Mapping[str, float]], chosen: Sequence[str]
) -> None:
    if not len(entropies) == len(sequence(expected, "expected")) + 1 == len(sequence(chosen, "chosen")) + 1:
        raise InvalidInputError(
            f"entropies: {len(entropies)} with {len(expected)} expected and {len(chosen)} chosen; "
            "expected one entropy more than actions"
        )
    for step, (options, action) in enumerate(zip(expected, chosen, strict=True)):
        for name, entropy in instance(options, f"expected[{step}]", Mapping).items():
            number(entropy, f"expected[{step}], action {plain_text(name, f'expected[{step}]')!r}")
        if options:
            one_of(action, f"chosen[{step}]", options)
