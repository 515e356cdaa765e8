"""How ATGs, memories and trials show themselves in a notebook: as small tables."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from atg_fg.html_table import Bar, Cell, HtmlTable, shortened

if TYPE_CHECKING:
    from collections.abc import Sequence

    from atg_fg.graph import AspectTransitionGraph
    from atg_fg.memory import RobotMemory
    from atg_fg.patterns import Detection
    from atg_fg.structure.memory import StructuredMemory
    from atg_fg.trial import TrialRecord, TrialStep
    from atg_fg.trial_log import TrialOutcome

#: Rows that are shown of a long table.
_ASPECTS: Final = 24
_OBJECTS: Final = 12
_LOOKS: Final = 40


def graph_view(graph: AspectTransitionGraph) -> HtmlTable:
    """Return a table of the known aspects, and of where each action was seen to lead."""
    assumptions, aspects = graph.assumptions, graph.aspects
    ways: dict[tuple[int, int], list[str]] = {}
    for (source, action, target), count in sorted(graph.counts.items()):
        times = "" if count == 1 else f" ×{count}"
        ways.setdefault((source, action), []).append(f"{_symbols(aspects[target])}{times}")
    rows: list[tuple[Cell, ...]] = [
        (
            _symbols(pattern),
            *("; ".join(ways.get((aspect, action), ["·"])) for action in range(len(assumptions.actions))),
        )
        for aspect, pattern in enumerate(aspects)
    ]
    title = f"{graph.name}: {graph.n_known} of {assumptions.n_aspects} aspects, {len(graph.counts)} observed edges"
    headings = (f"aspect ({', '.join(assumptions.alphabet.slots)})", *assumptions.actions)
    note = f"· not yet tried; collection node: {graph.n_unobserved} unobserved"
    return HtmlTable(title, headings if rows else (), shortened(rows, _ASPECTS, "aspects"), note)


def memory_view(memory: RobotMemory, more: str = "") -> HtmlTable:
    """Return a table of the remembered objects, with ``more`` to be said below it."""
    assumptions = memory.assumptions
    rows: list[tuple[Cell, ...]] = []
    # The last ones are not looked at: a memory may hold very many.
    for _, graph in zip(range(_OBJECTS), memory, strict=False):
        aspects = Bar(graph.n_known / assumptions.n_aspects, f"{graph.n_known} of {assumptions.n_aspects}")
        rows.append((graph.name, aspects, str(len(graph.counts)), str(sum(graph.counts.values()))))
    if len(memory) > len(rows):
        rows.append((f"… and {len(memory) - len(rows)} other objects", "", "", ""))
    title = f"Robot memory: {len(memory)} of {assumptions.n_objects} objects"
    headings = ("object", "known aspects", "edges", "seen, times") if rows else ()
    merged = f"; {len(memory.merges)} merged into others" if memory.merges else ""
    slots = f"{', '.join(assumptions.alphabet.slots)} of {assumptions.alphabet.n_symbols} symbols"
    note = f"actions {', '.join(assumptions.actions)}; slots {slots}{merged}{more}"
    return HtmlTable(title, headings, tuple(rows), note)


def structured_memory_view(memory: StructuredMemory) -> HtmlTable:
    """Return the table of a memory that also learns what its objects share."""
    believed = memory.learner.believed(memory.names)
    weights = f"with weights {', '.join(f'{each.weight:.2f}' for each in believed)}" if believed else "none"
    return memory_view(memory, f"; {len(memory.learner.trials)} raw trials; structures believed in: {weights}")


def record_view(record: TrialRecord) -> HtmlTable:
    """Return a table of a trial, look by look."""
    rows = [_step_row(number, step, record) for number, step in enumerate(record.steps)]
    ending = f"{record.verdict}{_of(record.matched)}" if rows else "nothing seen yet"
    title = f"Trial of {len(record.actions)} actions: {ending}"
    headings = ("look", f"seen ({', '.join(record.assumptions.alphabet.slots)})", "most probable object", "", "unseen")
    return HtmlTable(title, (*headings, "entropy, nats", "then"), shortened(rows, _LOOKS, "looks"))


def _step_row(number: int, step: TrialStep, record: TrialRecord) -> tuple[Cell, ...]:
    belief, best = step.belief, step.belief.most_probable_object
    name = "–" if best is None else record.names[best]
    share = 0.0 if best is None else float(belief.objects[best])
    then = [] if step.action is None else [record.assumptions.actions[step.action]]
    then += [] if step.purpose is None else [f"({step.purpose})"]
    return (
        str(number),
        _symbols(step.detection),
        name,
        Bar(share, f"{share:.3f}"),
        Bar(belief.unseen, f"{belief.unseen:.3f}"),
        f"{belief.entropy:.3f}",
        " ".join(then),
    )


def outcome_view(outcome: TrialOutcome) -> HtmlTable:
    """Return how a trial ended, what it was about, and what was seen."""
    title = f"Trial of {len(outcome.actions)} actions: {outcome.verdict}{_of(outcome.matched)}"
    seen = "; ".join(_symbols(detection) for detection in outcome.detections[:_LOOKS])
    return HtmlTable(title, ("object presented", "seen"), ((str(outcome.object), seen),))


def _of(matched: str | None) -> str:
    return "" if matched is None else f", {matched}"


def _symbols(pattern: Detection | Sequence[int]) -> str:
    return f"({', '.join('–' if symbol is None else str(symbol) for symbol in pattern)})"
