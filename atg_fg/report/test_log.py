"""The trials of a test (``atg-fg/test``) as a page; what the log leaves out is inferred again from its looks.

A log holds what was seen, done and learned in every trial, so that the robot's memory at the beginning of each follows
from those before it, and the belief over objects from that memory. It is shown only where it agrees with what was
recorded of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

from atg_fg.core.assumptions import Assumptions, arcube_assumptions
from atg_fg.core.errors import AtgError, InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence
from atg_fg.core.records import TrialOutcome
from atg_fg.engines import begin_trial
from atg_fg.experiments.scores import Score
from atg_fg.experiments.table1 import TestPlan
from atg_fg.experiments.trial import learn_from
from atg_fg.report import checked
from atg_fg.report.content import Look, Report, TrialPage, shown_parameters
from atg_fg.report.summaries import read_looks, verdict_of, with_graphs
from atg_fg.report.trial_record import best_objects
from atg_fg.storage.trial_log import read_log
from atg_fg.worlds.registry import ARCUBE_WORLDS, WORLDS, assumptions_of, make_world

#: How near a belief that is inferred again must be to the recorded one.
_TOLERANCE: Final = 1e-6
_NOT_INFERRED: Final = (
    "The belief over single objects is not recorded, and not inferred again for this model: what is shown of it is "
    "the probability that the object was never met."
)


def read_test_log(path: Path, memory: RobotMemory | None) -> Report:
    """Return the page of a test's trials.

    Args:
        path: The log.
        memory: Says what was taken for granted, where the log's world is a user's own.

    Raises:
        InvalidInputError: The file is not as it should be, or its world is not known.
    """
    return test_report(*read_log(path), path, memory)


def test_report(
    header: Mapping[str, Any], summaries: Sequence[Mapping[str, Any]], path: Path, memory: RobotMemory | None
) -> Report:
    """Return the page of a test's trials.

    Args:
        header: What test it is: its seed, and what its plan has other than usual.
        summaries: Of its trials, in their order.
        path: Where they come from, for messages.
        memory: As for ``read_test_log``.

    Raises:
        InvalidInputError: As for ``read_test_log``.
    """
    if not summaries:
        raise InvalidInputError(f"{path}: no trials; expected at least one")
    plan = _plan(header, path)
    assumptions = memory.assumptions if memory is not None else _assumptions(plan, path)
    test = _Test(plan, assumptions)
    pages = [test.page(summary, number, f"{path}: trial {number}") for number, summary in enumerate(summaries)]
    title = f"A test of {len(pages)} trials, {test.score.successes} of them right"
    notes = () if test.inferred else (_NOT_INFERRED,)
    return Report(title, shown_parameters(header), notes, assumptions, tuple(pages))


class _Test:
    """The robot's memory and the score, trial after trial."""

    def __init__(self, plan: TestPlan, assumptions: Assumptions) -> None:
        self._plan = plan
        self._assumptions = assumptions
        self._memory = RobotMemory(assumptions)
        self.score = Score()
        # Structure that is learned, and merges, take their time; such a memory does not follow from the log alone.
        self.inferred = not (plan.parameters.learn_structure or plan.merge_duplicates)

    def page(self, summary: Mapping[str, Any], number: int, place: str) -> TrialPage:
        """Return the page of the next trial, and learn from it."""
        looks = read_looks(summary, self._assumptions, place)
        verdict, matched = verdict_of(summary, place)
        if self.inferred:
            looks = self._with_beliefs(looks)
        presented = checked.presented(summary["truth"][0], f"{place}: truth[0]")
        met = "met before" if self.score.has_met(presented) else "never met before"
        truth = f"{checked.told_truth(summary['truth'][-1])}, {met}"
        page = TrialPage(f"trial {number}", verdict, truth, None, (), ())
        page = with_graphs(page, looks, self._memory if self.inferred else None, self._assumptions, matched)
        return replace(page, right=self._learn(summary, looks, matched, presented, place))

    def _with_beliefs(self, looks: list[Look]) -> list[Look]:
        """Return the looks with the belief over objects, if the memory leads to what was recorded."""
        inference = begin_trial("bayes-filter", self._memory, self._plan.parameters)
        found = []
        for look in looks:
            inference.observe(Evidence.of_detection(self._assumptions.alphabet, look.seen))
            belief = inference.identity()
            if max(abs(belief.unseen - look.unseen), abs(belief.entropy - look.entropy)) > _TOLERANCE:
                self.inferred = False
                return looks
            expected: tuple[tuple[str, float], ...] = ()
            if look.action is not None and self._plan.policy == "entropy":
                values = inference.expected_entropies().tolist()
                expected = tuple(zip(self._assumptions.actions, values, strict=True))
            objects = best_objects(self._memory.names, belief.objects.tolist())
            found.append(replace(look, objects=objects, expected=expected))
            if look.action is not None:
                inference.act(self._assumptions.action_index(look.action))
        return found

    def _learn(
        self, summary: Mapping[str, Any], looks: list[Look], matched: str | None, presented: int | str, place: str
    ) -> bool:
        """Let the memory learn from a trial; return whether its verdict was right."""
        alphabet = self._assumptions.alphabet
        seen = [Evidence.of_detection(alphabet, look.seen).pattern for look in looks]
        outcome = TrialOutcome(
            verdict=summary["verdict"],
            matched=matched,
            patterns=tuple(summary.get("learned", seen)),
            actions=tuple(self._assumptions.action_index(look.action) for look in looks if look.action is not None),
            object=presented,
            detections=tuple(look.seen for look in looks),
        )
        before = self.score.successes
        try:
            learned = learn_from(outcome, self._memory)
        except (AtgError, TypeError) as error:
            raise InvalidInputError(f"{place}: {error}; expected what the trials before it lead to") from error
        self.score.add(outcome, learned)
        return self.score.successes > before


def _plan(header: Mapping[str, Any], path: Path) -> TestPlan:
    """Return what the header says of the test, as far as the beliefs depend on it."""
    try:
        parameters = ModelParameters(**header.get("parameters", {}))
        if not isinstance(header.get("world", ""), str):
            raise InvalidInputError(f"world: {header['world']!r}; expected a name")
        wanted = ("world", "world_options", "policy", "merge_duplicates", "n_objects")
        return TestPlan(parameters=parameters, **{key: header[key] for key in wanted if key in header})
    except (TypeError, ValueError, AtgError) as error:
        raise InvalidInputError(f"{path}: header: {error}; expected what --records wrote") from error


def _assumptions(plan: TestPlan, path: Path) -> Assumptions:
    """Return what was taken for granted in the plan's world; no code that the file names is run for it."""
    if plan.world in ARCUBE_WORLDS:
        return arcube_assumptions(plan.n_objects)
    if plan.world not in WORLDS:
        raise InvalidInputError(
            f"{path}: world {plan.world!r} is no world of this package; expected --memory FILE of such a world"
        )
    with closing(make_world(plan.world, n_objects=plan.n_objects, objects_seed=0, **plan.world_options)) as world:
        return assumptions_of(world, plan.n_objects)
