"""The look by look of a trial whose record is a summary, as those of a test and of a goal run are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.report import checked
from atg_fg.report.content import Look, TrialPage
from atg_fg.report.graphs import TrialGraphs
from atg_fg.storage.checked_json import read_list

_VERDICTS = ("known", "novel", "lost", "undecided")


def read_looks(summary: Any, assumptions: Assumptions, place: str) -> list[Look]:
    """Return the looks of a summary (``atg_fg.storage.trial_log.summary_of``), checked.

    Raises:
        InvalidInputError: A field is missing or is not what was expected.
    """
    observed = read_list(checked.field_of(summary, "observed", place), f"{place}: observed")
    if not observed:
        raise InvalidInputError(f"{place}: observed: no looks; expected at least one")
    seen = [checked.detection(each, assumptions, f"{place}: observed[{i}]") for i, each in enumerate(observed)]
    given = checked.texts(checked.field_of(summary, "actions", place), f"{place}: actions")
    actions = [checked.action(each, assumptions, f"{place}: actions[{i}]") for i, each in enumerate(given)]
    # The object of a lost trial is gone after the last action, so that no look follows.
    if len(actions) not in (len(seen) - 1, len(seen)):
        raise InvalidInputError(f"{place}: {len(seen)} looks, {len(actions)} actions; expected one look more")
    unseen = checked.numbers(checked.field_of(summary, "unseen", place), f"{place}: unseen", len(seen), most=1.0)
    entropy = checked.numbers(checked.field_of(summary, "entropy", place), f"{place}: entropy", len(seen))
    truths = read_list(checked.field_of(summary, "truth", place), f"{place}: truth")
    purposes = read_list(summary.get("purpose", [None] * len(seen)), f"{place}: purpose")
    if len(truths) < len(seen) or len(purposes) < len(seen):
        raise InvalidInputError(f"{place}: truth of {len(truths)} looks; expected one for each of {len(seen)}")
    return [
        Look(
            seen[time],
            unseen[time],
            entropy[time],
            action=actions[time] if time < len(actions) else None,
            purpose=None if purposes[time] is None else str(purposes[time]),
            shown=checked.shown(truths[time]),
            slipped=isinstance(truths[time], Mapping) and bool(truths[time].get("slipped")),
        )
        for time in range(len(seen))
    ]


def verdict_of(summary: Mapping[str, Any], place: str) -> tuple[str, str | None]:
    """Return the verdict of a summary in words, and the name of the ATG that was matched."""
    verdict, matched = checked.field_of(summary, "verdict", place), summary.get("matched")
    if verdict not in _VERDICTS:
        raise InvalidInputError(f"{place}: verdict: {verdict!r}; expected one of: {', '.join(_VERDICTS)}")
    return told_verdict(str(verdict), matched), None if matched is None else str(matched)


def told_verdict(verdict: str, matched: object) -> str:
    """Return a verdict in words."""
    words = {"novel": "a new object", "lost": "none: the object was lost", "undecided": "none: nothing was seen"}
    return words.get(verdict, f"{matched}")


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
    return replace(page, looks=tuple(pointing), graphs=graphs.graphs)
