"""What the engines are meant to reach, and whether they did in a run."""

from __future__ import annotations

import statistics
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

from benchmarks.contestants import NaiveGraphs
from benchmarks.measuring import ratios
from benchmarks.peers import PEERS, PRESET

#: Returns a figure from the document of a run, or ``None`` if it was not measured.
Figure: TypeAlias = Callable[[dict[str, Any]], float | None]


@dataclass(frozen=True)
class Target:
    """A claim, the figure it is about, and the bound on it.

    Attributes:
        claim: In words, with the bound.
        figure: Finds the figure.
        bound: What it is held against.
        at_most: Whether the bound is the most, or else the least.
        unit: Of the figure.
    """

    claim: str
    figure: Figure
    bound: float
    unit: str
    at_most: bool = True

    def verdict(self, document: dict[str, Any]) -> dict[str, Any]:
        """Return the claim with what was found, and whether it was met; ``None`` if it was not measured."""
        found = self.figure(document)
        met = None if found is None else found <= self.bound if self.at_most else found >= self.bound
        return {"claim": self.claim, "bound": self.bound, "found": found, "unit": self.unit, "met": met}


def seconds_of(
    document: dict[str, Any], remembered: int, name: str, preset: str, quantity: str = "decision"
) -> list[float] | None:
    """Return the rounds of a contestant at a size, ``None`` if it was not measured."""
    for size in document["trials"]:
        for row in size["contestants"]:
            if (size["remembered"], row["name"], row["preset"]) == (remembered, name, preset) and "rounds" in row:
                rounds: list[float] = row["rounds"][quantity]
                return rounds
    return None


def milliseconds(remembered: int, name: str, preset: str, quantity: str = "decision") -> Figure:
    """Return the median milliseconds of a contestant as a figure."""

    def figure(document: dict[str, Any]) -> float | None:
        seconds = seconds_of(document, remembered, name, preset, quantity)
        return None if seconds is None else 1e3 * statistics.median(seconds)

    return figure


def best_peer(remembered: int, quantity: str = "decision") -> Figure:
    """Return how many times as long as ``bayes-filter`` the quickest peer takes, as a figure."""

    def figure(document: dict[str, Any]) -> float | None:
        own = seconds_of(document, remembered, "bayes-filter", PRESET, quantity)
        timed = (seconds_of(document, remembered, name, PRESET, quantity) for name in PEERS)
        peers = [seconds for seconds in timed if seconds is not None]
        if own is None or not peers:
            return None
        return min(statistics.median(ratios(seconds, own)) for seconds in peers)

    return figure


def in_floors(remembered: int) -> Figure:
    """Return how many times its floor a decision of ``bayes-filter`` takes, as a figure."""

    def figure(document: dict[str, Any]) -> float | None:
        own = milliseconds(remembered, "bayes-filter", PRESET)(document)
        least = [row["milliseconds"]["floor"] for row in document["floor"] if row["remembered"] == remembered]
        return None if own is None or not least else own / float(least[0])

    return figure


def peak_memory(remembered: int) -> Figure:
    """Return the most GB that a process of ``bayes-filter`` held, as a figure."""

    def figure(document: dict[str, Any]) -> float | None:
        measured = document.get("peak_memory")
        return measured["bytes"] / 1e9 if measured and measured["remembered"] == remembered else None

    return figure


def naive_over_gtsam(document: dict[str, Any]) -> float | None:
    """Return how many times as long as ``gtsam`` the naive graphs take for a decision at 100 objects."""
    naive = seconds_of(document, 100, NaiveGraphs.name, NaiveGraphs.preset)
    own = seconds_of(document, 100, "gtsam", NaiveGraphs.preset)
    return None if naive is None or own is None else statistics.median(ratios(naive, own))


def table1_seconds(engine: str) -> Figure:
    """Return the median seconds of Table 1 as a figure; less than the paper's trials are no Table 1."""

    def figure(document: dict[str, Any]) -> float | None:
        found = [row["seconds"]["median"] for row in document["table1"]["engines"] if row["engine"] == engine]
        return float(found[0]) if found and document["table1"]["trials"] == 100 else None

    return figure


def worker_start(quantity: str) -> Figure:
    """Return the median seconds of a quantity of ``benchmarks.worker_start`` as a figure."""

    def figure(document: dict[str, Any]) -> float | None:
        measured = document.get("worker_start", {"seconds": {}})["seconds"].get(quantity)
        return None if measured is None else float(measured["median"])

    return figure


def growth(quantity: str) -> Figure:
    """Return how many times as long ``large-memory`` takes in the larger memory, if that has 100,000 objects."""

    def figure(document: dict[str, Any]) -> float | None:
        matches = document["equal_matches"]
        measured = "ratio" in matches and matches["sizes"] == [100, 100_000]
        return float(matches["ratio"][quantity]["median"]) if measured else None

    return figure


LARGE: Final = 100_000
TARGETS: Final = (
    Target("`gtsam`: a decision at 100 objects ≤ 20 ms", milliseconds(100, "gtsam", "paper"), 20, "ms"),
    Target("`gtsam`: the same with its factors made again ≤ 25 ms", milliseconds(100, "gtsam", "default"), 25, "ms"),
    Target("`gtsam`: ≥ 5,000 times as quick as the naive graphs", naive_over_gtsam, 5000, "times", at_most=False),
    *(
        Target(
            f"`bayes-filter`: {words} at {remembered:,} ≥ {bound} times as quick as the best peer",
            best_peer(remembered, quantity),
            bound,
            "times",
            at_most=False,
        )
        for words, quantity, bounds in (
            ("a decision", "decision", {100: 20, 1_000: 25, 10_000: 30}),
            ("a filter step", "step", {100: 5, 1_000: 6}),
            ("a trial", "trial", {100: 10, 1_000: 12}),
        )
        for remembered, bound in bounds.items()
    ),
    Target("`bayes-filter`: a decision at 100 ≤ 10 floors", in_floors(100), 10, "floors"),
    Target("`bayes-filter`: most memory held at 100,000 ≤ 1 GB", peak_memory(LARGE), 1, "GB"),
    Target("`learned-structure`: a decision at 100 ≤ 3 ms", milliseconds(100, "learned-structure", "learned"), 3, "ms"),
    Target("Table 1, `gtsam`, two cores ≤ 45 s", table1_seconds("gtsam"), 45, "s"),
    Target("Table 1, `bayes-filter`, one core ≤ 3 s", table1_seconds("bayes-filter"), 3, "s"),
    Target(
        "two worker processes: what they add to a command, a trial by each ≤ 0.5 s", worker_start("added"), 0.5, "s"
    ),
    Target(
        "two worker processes of a process's later campaigns: begun, with a trial by each ≤ 0.5 s",
        worker_start("later"),
        0.5,
        "s",
    ),
    Target(
        "`large-memory`: a decision at 100,000 objects ≤ 1.5 times one at 100, equal matches",
        growth("decision"),
        1.5,
        "times",
    ),
    Target("`large-memory`: the same with a filter step ≤ 3 times", growth("decision and step"), 3, "times"),
    Target(
        "`large-memory`: first decision at 100,000 cubes ≤ 10 ms",
        milliseconds(LARGE, "large-memory", "default", "first decision"),
        10,
        "ms",
    ),
    Target(
        "`large-memory`: last decision at 100,000 cubes ≤ 40 ms",
        milliseconds(LARGE, "large-memory", "default", "last decision"),
        40,
        "ms",
    ),
)
