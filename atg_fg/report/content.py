"""What a page shows, whatever file it comes from: trials look by look, or the tables and plots of an experiment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any, TypeAlias

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.patterns import Detection, PatternAlphabet
from atg_fg.core.table import Table

#: (name, value) pairs in the order in which they are shown.
Named: TypeAlias = tuple[tuple[str, float], ...]


@dataclass(frozen=True)
class Look:
    """One look and what was done after it.

    Attributes:
        seen: The symbol seen in each slot, ``None`` where nothing was.
        unseen: Probability that the object was never met.
        entropy: H(O) in nats.
        objects: The most probable remembered objects, best first; empty if the record does not say.
        expected: Expected entropy of each action in nats; empty if the policy did not look at them.
        action: Name of the action chosen next, ``None`` at the end.
        purpose: What the action is for, if the policy says so.
        shown: The pattern that was shown, by the world's truth, if the truth says so.
        slipped: Whether the action before this look failed, by the truth.
        graph: Index, in the trial's graphs, of the ATG of what the robot would judge the object to be.
        frame: The camera frame as a ``data:`` address, if there is one.
        verdict_entropy: Of the verdict in nats: *unseen* is one state of it, however many objects were never met; as
            ``entropy`` where it is not known how many.
    """

    seen: Detection
    unseen: float
    entropy: float
    objects: Named = ()
    expected: Named = ()
    action: str | None = None
    purpose: str | None = None
    shown: tuple[int, ...] | None = None
    slipped: bool = False
    graph: int = 0
    frame: str | None = None
    verdict_entropy: float = 0.0


@dataclass(frozen=True)
class PlacedGraph:
    """An ATG as it is drawn, with room for the aspects that the trial adds to it.

    Attributes:
        name: Of the object, or what the graph is.
        remembered: Number of its aspects that were known before the trial.
        aspects: The symbols of each aspect, remembered ones first, then those that the trial adds.
        places: Middle of each aspect, (x, y) with y upwards, on a circle about the origin.
        edges: (source, action, target, count) of the remembered transitions.
    """

    name: str
    remembered: int
    aspects: tuple[tuple[int, ...], ...]
    places: tuple[tuple[float, float], ...]
    edges: tuple[tuple[int, int, int, int], ...]


@dataclass(frozen=True)
class TrialPage:
    """One trial.

    Attributes:
        title: What it is called in the chooser.
        verdict: How it ended, as the robot says.
        truth: What was presented and came of it, by the world.
        right: Whether the verdict is right by the truth; ``None`` if the record cannot tell.
        looks: All looks, at least one; ``with_graphs`` adds them.
        graphs: The ATGs that the looks point at.
        goal: The symbols wanted, ``None`` where any will do, if there was a goal.
        notes: Sentences on what the robot made of the trial later, or of its looks in the end.
        thumbnails: Crops that are drawn in place of symbols, as ``data:`` addresses.
    """

    title: str
    verdict: str
    truth: str
    right: bool | None
    looks: tuple[Look, ...] = ()
    graphs: tuple[PlacedGraph, ...] = ()
    goal: Detection | None = None
    notes: tuple[str, ...] = ()
    thumbnails: Mapping[int, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Point:
    """A point of a plot with its interval, if it has one."""

    x: float
    y: float
    low: float | None = None
    high: float | None = None
    label: str = ""


@dataclass(frozen=True)
class Series:
    """Points of one kind, joined by a line or each by itself."""

    name: str
    points: tuple[Point, ...]
    joined: bool = True


@dataclass(frozen=True)
class Plot:
    """A plot over numbers, or over categories that stand at 0, 1, 2 and so on.

    Attributes:
        title: Above the plot.
        x_label: What the horizontal axis is.
        y_label: What the vertical axis is.
        series: What is drawn.
        categories: Names on the horizontal axis, in place of numbers.
        y_range: Of the vertical axis.
    """

    title: str
    x_label: str
    y_label: str
    series: tuple[Series, ...]
    categories: tuple[str, ...] = ()
    y_range: tuple[float, float] = (0.0, 100.0)


@dataclass(frozen=True)
class Report:
    """A page.

    Attributes:
        title: Heading.
        parameters: What the trial or the experiment was run with, as shown.
        notes: Sentences on what the file does not hold, or how something was come by.
        assumptions: Of the trials.
        trials: The trials, if the file is of trials.
        gallery: The ATGs, if the file is a memory.
        tables: Of an experiment.
        plots: Of an experiment.
    """

    title: str
    parameters: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    assumptions: Assumptions | None = None
    trials: tuple[TrialPage, ...] = ()
    gallery: tuple[PlacedGraph, ...] = ()
    tables: tuple[Table, ...] = ()
    plots: tuple[Plot, ...] = ()

    def trial_data(self) -> dict[str, Any]:
        """Return what the page's script needs of the trials, as JSON knows it."""
        if self.assumptions is None:
            return {"trials": []}
        return {
            "slots": list(self.assumptions.alphabet.slots),
            "actions": list(self.assumptions.actions),
            "n_aspects": self.assumptions.n_aspects,
            "trials": [_named(asdict(trial), self.assumptions.alphabet) for trial in self.trials],
            **(
                {"gallery": [_named(asdict(graph), self.assumptions.alphabet) for graph in self.gallery]}
                if self.gallery
                else {}
            ),
        }


def _named(value: Any, alphabet: PatternAlphabet, field: str = "") -> Any:
    """Return the fields of a page with the names of symbols in place of their numbers, where they have names."""
    if not alphabet.names or value is None:
        return value
    if field in ("seen", "shown", "goal"):
        return [None if symbol is None else alphabet.name_of(symbol) for symbol in value]
    if field == "thumbnails":
        return {alphabet.name_of(symbol): address for symbol, address in value.items()}
    if field == "aspects":
        return [list(map(alphabet.name_of, pattern)) for pattern in value]
    if isinstance(value, dict):
        return {name: _named(each, alphabet, name) for name, each in value.items()}
    return [_named(each, alphabet) for each in value] if field in ("looks", "graphs") else value


def shown_parameters(fields: Mapping[str, Any]) -> dict[str, str]:
    """Return parameters as texts, without those that are empty, zero or false."""
    return {name.replace("_", " "): _text(value) for name, value in fields.items() if value or name == "seed"}


def _text(value: Any) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {_text(each)}" for name, each in value.items())
    if isinstance(value, list):
        return ", ".join(map(_text, value))
    return f"{value:g}" if isinstance(value, float) else str(value)
