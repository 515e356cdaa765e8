"""The look by look of a trial, from what records keep of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.core.records import StepSummary, TrialSummary
from atg_fg.report.content import Look, TrialPage
from atg_fg.report.graphs import TrialGraphs
from atg_fg.report.kinds import told_kind


def look_of(step: StepSummary, n_unseen: int | None) -> Look:
    """Return a look as a page shows it.

    Args:
        step: What is kept of it.
        n_unseen: How many objects were never met, ``None`` if that is not known.
    """
    # All of them are alike to the robot, so that which one it is adds the logarithm of their number.
    of_unseen = 0.0 if n_unseen is None else step.unseen * math.log(n_unseen)
    return Look(
        step.observed,
        step.unseen,
        step.entropy,
        expected=tuple((step.expected_entropy or {}).items()),
        action=step.action,
        purpose=step.purpose,
        shown=_shown(step.truth),
        slipped=bool(step.truth.get("slipped")),
        verdict_entropy=max(step.entropy - of_unseen, 0.0),
    )


def looks_of(trial: TrialSummary, n_unseen: int | None) -> list[Look]:
    """Return the looks of a trial; ``n_unseen`` is as for ``look_of``."""
    return [look_of(step, n_unseen) for step in trial.steps]


def _shown(truth: Mapping[str, Any]) -> tuple[int, ...] | None:
    """Return the pattern that a world's truth says was shown, ``None`` if it says none.

    Where a sense finds classes of appearance, the truth numbers pictures, and what was seen numbers classes.
    """
    pattern = None if truth.get("readings") else truth.get("pattern")
    if isinstance(pattern, (list, tuple)) and all(isinstance(symbol, int) for symbol in pattern):
        return tuple(pattern)
    return None


def told_truth(truth: Mapping[str, Any], name: str | None = None) -> str:
    """Return in words what was presented, by a world's truth; ``name`` is of the ATG that was made from it, if any."""
    if "object" not in truth:
        return "not recorded"
    presented = truth["object"]
    told = f"object number {presented}" if isinstance(presented, int) else str(presented)
    return (told if name is None else f"{name} ({told})") + (", lost" if truth.get("lost") else "")


def told_verdict(verdict: str, matched: object) -> str:
    """Return a verdict in words."""
    words = {"novel": "a new object", "lost": "none: the object was lost", "undecided": "none: nothing was seen"}
    return words.get(verdict, f"{matched}")


def told_mistakes(trial: TrialSummary, assumptions: Assumptions) -> tuple[str, ...]:
    """Return in words which looks the robot took for mistakes."""
    slots = assumptions.alphabet.slots
    return tuple(
        f"Look {look}{f', {slots[slot]},' if len(slots) > 1 else ''} was probably a mistake: {probability:.0%}."
        for look, slot, probability in trial.mistakes
    )


def with_graphs(
    page: TrialPage, looks: Sequence[Look], memory: RobotMemory | None, assumptions: Assumptions, matched: str | None
) -> TrialPage:
    """Return the page with these looks, each pointing at the ATG of what the robot would judge the object to be then.

    That is a new object, or the most probable one; where a look does not say which, the one matched at the end.
    """
    actions = [look.action for look in looks if look.action is not None]
    graphs = TrialGraphs(memory, assumptions, [look.seen for look in looks], actions)
    pointing = []
    for look in looks:
        best = look.objects[0][0] if look.objects else matched
        pointing.append(replace(look, graph=graphs.index_of(None if look.unseen > 0.5 else best)))
    notes = (*page.notes, *told_kind(memory, matched))
    return replace(page, looks=tuple(pointing), graphs=graphs.graphs, notes=notes)
