"""The trials in a robot memory database as a page: those of tests as in their logs, others from their own records."""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions, arcube_assumptions
from atg_fg.core.errors import AtgError, InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.records import Experiment, TrialSummary
from atg_fg.report.content import Report, TrialPage, shown_parameters
from atg_fg.report.graphs import TrialGraphs, gallery
from atg_fg.report.kinds import told_kind, told_kinds
from atg_fg.report.summaries import looks_of, told_truth, told_verdict
from atg_fg.report.test_log import Retelling, test_report
from atg_fg.storage.database.memory_reading import database_holds_memory
from atg_fg.storage.database.trial_log import TEST_KIND, read_stored_experiments, read_stored_trials
from atg_fg.storage.memory_files import load_memory
from atg_fg.storage.presets import PRESETS
from atg_fg.storage.recorded_header import read_header
from atg_fg.storage.recorded_test import stored_test
from atg_fg.worlds.registry import WORLDS

_NOTE: Final = (
    "A database keeps no belief over single objects: what is shown of it is the probability that the object was never "
    "met. The graph is the ATG that the trial was learned into, as it is now."
)


def read_database(path: Path, memory: RobotMemory | None) -> Report:
    """Return the page of all trials in a database, or of the ATGs of its memory if there are no trials.

    Args:
        path: The database.
        memory: Says what was taken for granted, where the database holds no memory and a test's world is a user's own.

    Raises:
        InvalidInputError: It cannot be read, or anything in it is not as it should be.
    """
    held = load_memory(path) if database_holds_memory(path) else None
    taught = _Taught(path, memory or held)
    experiments: list[Experiment | None] = [*read_stored_experiments(path), None]
    reports = [report for each in experiments if (report := taught.report(each)) is not None]
    if not reports and held is not None and len(held):
        return gallery(held, path.name)
    if not reports:
        raise InvalidInputError(f"{path}: no trials; expected at least one")
    return reports[0] if len(reports) == 1 else _joined(reports, path)


def _joined(reports: list[Report], path: Path) -> Report:
    """Return one page of several experiments under the same assumptions."""
    assumptions = reports[0].assumptions
    if any(report.assumptions != assumptions for report in reports):
        raise InvalidInputError(f"{path}: tests in different worlds; expected one kind of objects in a page")
    trials = [
        replace(page, title=f"{number}: {page.title}")
        for number, report in enumerate(reports, 1)
        for page in report.trials
    ]
    notes = tuple(dict.fromkeys(note for report in reports for note in report.notes))
    title = f"{len(trials)} trials of {len(reports)} experiments"
    return Report(title, shown_parameters({"file": path.name}), notes, assumptions, tuple(trials))


class _Taught:
    """The experiments of a database, one after the other.

    What it was taught is taken off the memory of today, and the beliefs of its trials are inferred again from there, as
    for a test. Where that does not lead to what was recorded, as it learned something else besides, the ATGs are those
    of today.

    Args:
        path: The database.
        memory: Of today.
    """

    def __init__(self, path: Path, memory: RobotMemory | None) -> None:
        self._path, self._memory = path, memory
        self._retelling: Retelling | None = None
        taught = [trial for trial in read_stored_trials(path) if trial.learned is not None]
        self._before = None if memory is None else _memory_before(memory, taught)
        # How many ATGs the memory had before the first trial: it has those of today, but for what it was taught since.
        new = sum(trial.verdict == "novel" for trial in taught)
        self._n_remembered = 0 if memory is None else max(len(memory) + len(memory.merges) - new, 0)

    def report(self, experiment: Experiment | None) -> Report | None:
        """Return the page of an experiment, or of the trials that belong to none; ``None`` if there are no trials."""
        stated = None if self._memory is None else self._memory.assumptions
        if experiment is not None and experiment.kind == TEST_KIND:
            test = stored_test(self._path, experiment, stated)
            return test_report(test, None) if test.trials else None
        assumptions, about = stated or arcube_assumptions(), {} if experiment is None else experiment.parameters
        # The memory that is there now may be of another world than the one that the trials were run in.
        if experiment is not None and about.get("world") in list(WORLDS):
            assumptions = read_header(about, f"{self._path}: experiment {experiment.number}")[1] or assumptions
        number = None if experiment is None else experiment.number
        trials = list(read_stored_trials(self._path, number, assumptions, alone=experiment is None))
        if not trials:
            return None
        pages = []
        for trial in trials:
            pages.append(self._page(trial, about, assumptions))
            self._n_remembered += trial.verdict == "novel" and trial.learned is not None
        kind = "trial" if experiment is None else experiment.kind
        parameters = {} if experiment is None else {"seed": experiment.seed, **about}
        title = f"{kind}, {len(pages)} of them" if len(pages) > 1 else f"A {kind}, look by look"
        notes = () if self._retelling is not None and self._retelling.inferred else (_NOTE, *told_kinds(self._memory))
        return Report(title, shown_parameters(parameters), notes, assumptions, tuple(pages))

    def _page(self, trial: TrialSummary, about: Mapping[str, Any], assumptions: Assumptions) -> TrialPage:
        if self._retelling is None:
            before = self._before if self._before is not None and self._before.assumptions == assumptions else None
            self._retelling = Retelling(assumptions, inferred=True, memory=before)
        told, name = self._retelling, about.get("preset")
        parameters = PRESETS[name] if isinstance(name, str) and name in PRESETS else None
        told.inferred = told.inferred and parameters is not None and not parameters.learn_structure
        if told.inferred and parameters is not None:
            with contextlib.suppress(AtgError):  # what this memory did not lead to
                page = told.page(trial, f"trial {trial.number}", parameters, by_entropy=False)
                if told.inferred:
                    return page
            told.inferred = False
        return self._page_of_today(trial, assumptions)

    def _page_of_today(self, trial: TrialSummary, assumptions: Assumptions) -> TrialPage:
        memory, n_unseen = self._memory, max(assumptions.n_objects - self._n_remembered, 1)
        if memory is not None and replace(assumptions, n_objects=memory.assumptions.n_objects) != memory.assumptions:
            memory = None
        graphs = TrialGraphs(memory, assumptions, trial.detections, trial.actions)
        index = graphs.index_of(trial.learned)
        return TrialPage(
            title=f"trial {trial.number}",
            verdict=told_verdict(trial.verdict, trial.matched),
            truth=told_truth(trial.truths[-1]),
            right=None,
            looks=tuple(replace(look, graph=index) for look in looks_of(trial, n_unseen)),
            graphs=graphs.graphs,
            notes=told_kind(memory, trial.learned),
        )


def _memory_before(memory: RobotMemory, taught: Sequence[TrialSummary]) -> RobotMemory:
    """Return what a memory held before it learned from trials: without the aspects and counts that they taught.

    An aspect of which they alone showed a transition is taken for one that they taught. Of a memory that does not hold
    what they taught, nothing is told: an empty one is returned.
    """
    born = {trial.learned for trial in taught if trial.verdict == "novel"}
    own: dict[str, AspectTransitionGraph] = {}
    before = RobotMemory(memory.assumptions)
    try:
        for trial in taught:
            if trial.learned is not None:
                graph = own.setdefault(trial.learned, AspectTransitionGraph(trial.learned, memory.assumptions))
                actions = [memory.assumptions.action_index(name) for name in trial.actions[: len(trial.steps) - 1]]
                graph.learn(list(trial.patterns), actions)
        for graph in memory:
            if graph.name not in born:
                before.add(_without(graph, own[graph.name]) if graph.name in own else graph)
    except AtgError:
        return RobotMemory(memory.assumptions)
    return before


def _without(graph: AspectTransitionGraph, taught: AspectTransitionGraph) -> AspectTransitionGraph:
    """Return a graph without what another one counted."""
    counts = Counter(_by_pattern(graph))
    counts.subtract(_by_pattern(taught))
    shown = {pattern for (source, _, target), count in counts.items() if count for pattern in (source, target)}
    kept = [pattern in shown or taught.aspect_showing(pattern) is None for pattern in graph.pattern_indices]
    # Aspects stand in the order in which they were met.
    n_known = len(kept) - kept[::-1].index(True) if any(kept) else 0
    before = AspectTransitionGraph(graph.name, graph.assumptions)
    for pattern in graph.aspects[:n_known]:
        before.add_aspect(pattern)
    for (source, action, target), count in counts.items():
        start, end = before.aspect_showing(source), before.aspect_showing(target)
        if count and start is not None and end is not None:
            before.add_transition(start, action, end, count)
    return before


def _by_pattern(graph: AspectTransitionGraph) -> dict[tuple[int, int, int], int]:
    patterns = graph.pattern_indices
    return {(patterns[source], action, patterns[target]): n for (source, action, target), n in graph.counts.items()}
