"""The trials of a user's recording, with the belief after every look, as a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from atg_fg.core.memory import RobotMemory
from atg_fg.core.records import TrialSummary
from atg_fg.experiments.recorded_trials import Recognised
from atg_fg.report.content import Report, TrialPage
from atg_fg.report.kinds import told_kinds
from atg_fg.report.page import write_report
from atg_fg.report.summaries import look_of, told_mistakes, told_truth, told_verdict, with_graphs
from atg_fg.report.trial_record import best_objects


def write_page(found: Sequence[Recognised], memory: RobotMemory, score: Mapping[str, Any] | None, path: Path) -> None:
    """Write the page of trials that were recognised.

    Args:
        found: The trials.
        memory: As it is after the last of them; its ATGs are shown.
        score: What is right, if the truth is known.
        path: The file.

    Raises:
        InvalidInputError: It cannot be written.
        MissingDependencyError: Jinja2 is not installed.
    """
    pages = tuple(_page(each, memory) for each in found)
    right = "" if score is None else f", {score['success']['count']} of them right"
    note = "The graph is the ATG that the object is taken for, as it is after the last trial."
    notes = (note, *told_kinds(memory))
    write_report(Report(f"{len(pages)} trials of a recording{right}", {}, notes, memory.assumptions, pages), path)


def _page(each: Recognised, memory: RobotMemory) -> TrialPage:
    trial = TrialSummary.of(each.record)
    n_unseen = max(memory.assumptions.n_objects - len(each.record.names), 1)
    looks = [
        replace(look_of(summary, n_unseen), objects=best_objects(list(each.record.names), step.belief.objects.tolist()))
        for summary, step in zip(trial.steps, each.record.steps, strict=True)
    ]
    page = TrialPage(
        f"trial {each.trial.name}",
        told_verdict(trial.verdict, trial.matched),
        told_truth(trial.truths[-1]) if each.trial.object is not None else "not known",
        each.right,
        notes=told_mistakes(trial, memory.assumptions),
    )
    return with_graphs(page, looks, memory, memory.assumptions, trial.matched or each.learned)
