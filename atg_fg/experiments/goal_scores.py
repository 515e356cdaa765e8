"""How serving an object went: by what the robot says, by the truth, and by what its memory would have allowed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import networkx

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.goals import Goal
from atg_fg.core.memory import RobotMemory
from atg_fg.core.records import TrialRecord
from atg_fg.core.statistics import mean, rate_document, wilson_interval
from atg_fg.core.table import ROWS, Cell, Table, shortened
from atg_fg.inference.known_transitions import transitions_of_graph
from atg_fg.policies.shortest_paths import nearest_aspect, shortest_path
from atg_fg.worlds.arcube import ORIENTATIONS, SUCCESSORS, Cube, shown_pattern

#: How serving an object can end: as the policy says, or because the actions ran out, or the object was lost.
Ending: TypeAlias = Literal["reached", "unreachable", "exhausted", "lost"]


@dataclass(frozen=True)
class ServedObject:
    """What came of one goal.

    Attributes:
        object: Number of the object, by the world's truth.
        goal: The symbols wanted, one a slot, ``None`` where any will do.
        ending: How it ended, as the robot says.
        matched: Number of the object that the robot took it for; ``None`` if it did not settle on one.
        judged_new: Whether the robot took it for an object that it had never met.
        shown: Whether the goal was shown at the end, by the truth.
        reachable: Whether known transitions of the true object led to the goal from where recognition ended.
        recognition_actions: Actions that served to recognise.
        goal_actions: Actions towards the goal, or to explore for a way to it.
        optimum: Fewest actions from where recognition ended to the goal, by the truth.
        nearest: The pattern most like the goal that the robot knew how to show, if it gave the goal up.
    """

    object: int
    goal: tuple[int | None, ...]
    ending: Ending
    matched: int | None
    judged_new: bool
    shown: bool
    reachable: bool
    recognition_actions: int
    goal_actions: int
    optimum: int
    nearest: tuple[int, ...] | None

    @property
    def wrong_object(self) -> bool:
        """Whether the robot took the object for another, or for a new one."""
        return self.judged_new or self.matched not in (None, self.object)

    def _repr_html_(self) -> str:
        return table_of_goals([self])._repr_html_()


def score(
    record: TrialRecord, goal: Goal, reached: bool, memory: RobotMemory, cube: Cube, learn_in_trial: bool = True
) -> ServedObject:
    """Return what came of a goal from the record of the trial.

    Args:
        record: Of a trial with ``GoalPolicy``.
        goal: What was wanted.
        reached: Whether the robot says that the goal is shown at the end.
        memory: That the trial began with; its ATGs are of the world's objects, in their order.
        cube: The object, by the truth.
        learn_in_trial: Whether the robot may plan with the transitions that the trial itself has shown.
    """
    purposes = [step.purpose for step in record.steps]
    decided = next(
        (time for time, purpose in enumerate(purposes) if purpose not in ("recognise", None)), len(purposes) - 1
    )
    number = int(record.steps[0].truth["object"])
    truth = record.lost_truth or record.steps[-1].truth
    settled = any(purpose in ("approach", "explore", "unreachable") for purpose in purposes)
    ending: Ending = "lost" if record.lost_truth else "reached" if reached else _given_up(purposes[-1])
    shown_at_decision = record.steps[decided].truth
    known = memory[record.names[number]].copy()
    if learn_in_trial:
        known.learn(record.patterns[: decided + 1], record.actions[:decided])
    return ServedObject(
        object=number,
        goal=goal.symbols,
        ending=ending,
        matched=record.names.index(record.matched) if settled and record.matched is not None else None,
        judged_new=settled and record.judged_novel,
        shown=bool(goal.patterns[goal.alphabet.index(truth["pattern"])]),
        reachable=_leads_to(known, shown_at_decision["pattern"], goal),
        recognition_actions=purposes.count("recognise"),
        goal_actions=purposes.count("approach") + purposes.count("explore"),
        optimum=fewest_actions(cube, int(shown_at_decision["orientation"]), goal),
        nearest=_nearest(record, memory, goal) if ending == "unreachable" else None,
    )


def fewest_actions(cube: Cube, orientation: int, goal: Goal) -> int:
    """Return the fewest actions from an orientation of a cube to one that shows the goal, by the true graph."""
    true: networkx.DiGraph[int] = networkx.DiGraph(
        (source, target) for source, row in enumerate(SUCCESSORS) for target in row
    )
    lengths = networkx.single_source_shortest_path_length(true, orientation)
    patterns = [goal.alphabet.index(shown_pattern(cube, each)) for each in range(len(ORIENTATIONS))]
    return min(int(lengths[each]) for each, pattern in enumerate(patterns) if goal.patterns[pattern])


def _given_up(last_purpose: str | None) -> Ending:
    return "unreachable" if last_purpose == "unreachable" else "exhausted"


def _leads_to(known: AspectTransitionGraph, pattern: Sequence[int], goal: Goal) -> bool:
    """Whether an ATG knows the pattern shown, and a path from there to the goal."""
    aspect = known.aspect_showing(goal.alphabet.index(pattern))
    return aspect is not None and shortest_path(transitions_of_graph(known), aspect, goal) is not None


def _nearest(record: TrialRecord, memory: RobotMemory, goal: Goal) -> tuple[int, ...] | None:
    """Return the pattern most like the goal that the robot knows how to show, of what it takes the object for."""
    graph = (
        AspectTransitionGraph("new", memory.assumptions) if record.matched is None else memory[record.matched].copy()
    )
    graph.learn(record.patterns, record.actions)
    pattern = record.patterns[-1]
    aspect = None if pattern is None else graph.aspect_showing(pattern)
    if aspect is None:
        return None
    return graph.aspects[nearest_aspect(transitions_of_graph(graph), aspect, goal).aspects[-1]]


def summarise(runs: Sequence[Sequence[ServedObject]]) -> dict[str, Any]:
    """Return rates with 95 % Wilson intervals over all goals, or all runs, and numbers of actions.

    Goals of a run share a memory; the rates over runs do not depend on how alike they are.
    """
    served = [each for run in runs for each in run]
    reachable = [each for each in served if each.reachable]
    # A goal may be met by chance on the way to it, or while recognising again.
    unreachable = [each for each in served if not each.reachable and each.ending != "reached"]
    approached = [each for each in reachable if each.ending == "reached"]
    return {
        "runs": len(runs),
        "goals": len(served),
        "reached": rate_document(sum(each.ending == "reached" for each in served), len(served)),
        "reachable": rate_document(len(reachable), len(served)),
        "reached_of_reachable": rate_document(len(approached), len(reachable)),
        "declared_of_unreachable": rate_document(
            sum(each.ending == "unreachable" for each in unreachable), len(unreachable)
        ),
        "runs_with_all_reachable_reached": rate_document(
            sum(all(each.ending == "reached" and each.shown for each in run if each.reachable) for run in runs),
            len(runs),
        ),
        "wrong_success": rate_document(
            sum(each.ending == "reached" and not each.shown for each in served),
            sum(each.ending == "reached" for each in served),
        ),
        "wrong_object": rate_document(sum(each.wrong_object for each in served), len(served)),
        "exhausted": sum(each.ending == "exhausted" for each in served),
        "lost": sum(each.ending == "lost" for each in served),
        "recognition_actions": mean([each.recognition_actions for each in served]),
        "goal_actions": mean([each.goal_actions for each in approached]),
        "optimum": mean([each.optimum for each in approached]),
        "optimal": rate_document(sum(each.goal_actions == each.optimum for each in approached), len(approached)),
    }


def table_of_goals(served: Sequence[ServedObject], title: str = "") -> Table:
    """Return what came of each goal."""
    rows: list[tuple[Cell, ...]] = [
        (
            str(each.object),
            f"({', '.join('any' if symbol is None else str(symbol) for symbol in each.goal)})",
            each.ending,
            "new" if each.judged_new else "–" if each.matched is None else str(each.matched),
            str(each.recognition_actions),
            f"{each.goal_actions} of at least {each.optimum}",
        )
        for each in served
    ]
    reached = sum(each.ending == "reached" for each in served)
    low, high = wilson_interval(reached, len(served))
    note = f"reached {reached} of {len(served)} ({100 * low:.1f}–{100 * high:.1f} %, 95 % Wilson interval)"
    headings = ("object", "goal", "ending", "taken for", "actions to recognise", "actions to the goal")
    return Table(
        title or f"{len(served)} {'goal' if len(served) == 1 else 'goals'}",
        headings,
        shortened(rows, ROWS, "goals"),
        note,
    )
