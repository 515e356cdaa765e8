"""The document of a run as tables, for the terminal and for a Markdown page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from benchmarks.contestants import LARGE_MEMORY
from benchmarks.trials import reference_of

QUANTITIES: Final = {
    "decision": "One decision: expected entropy of all actions",
    "step": "One filter step: an action and the look after it",
    "trial": "One whole trial: begun, {actions} actions, each with a decision, and {looks} looks",
}
MADE_BEFORE: Final = (
    "An engine makes its tables of the memory at the beginning of every trial, since the memory may have learned; "
    "those of the other libraries are made, and compiled, before."
)


@dataclass(frozen=True)
class Table:
    """A table; the first column is words, the others are figures.

    Attributes:
        title: What it is of.
        headings: One a column.
        rows: One text a column.
        notes: What has to be known to read it.
    """

    title: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str]]
    notes: Sequence[str] = ()

    def markdown(self) -> str:
        """Return the table as Markdown, its notes below it."""
        lines = [f"**{self.title}**", ""]
        lines.append(f"| {' | '.join(self.headings)} |")
        lines.append(f"|---|{'---:|' * (len(self.headings) - 1)}")
        lines += [f"| {' | '.join(row)} |" for row in self.rows]
        lines += [line for note in self.notes for line in ("", note)]
        return "\n".join(lines) + "\n"


def tables(document: dict[str, Any]) -> list[Table]:
    """Return all tables of a run."""
    timed = [_trials_table(document, quantity) for quantity in QUANTITIES]
    return [
        _targets_table(document),
        *timed,
        _left_out_table(document),
        _agreement_table(document),
        _floor_table(document),
        _matches_table(document),
        _table1_table(document),
        _start_table(document["worker_start"]),
        *([_against_table(document["against"])] if document.get("against") else []),
    ]


def machine_line(document: dict[str, Any]) -> str:
    """Return what was measured on, in one sentence."""
    machine = document["machine"]
    packages = ", ".join(f"{name} {version}" for name, version in machine["packages"].items() if version)
    threads = ", ".join(f"{name}={value}" for name, value in machine["threads"].items())
    limits = f"; {threads}" if threads else ""
    if machine["load"] is not None:
        limits += f"; load at the start {machine['load']:g}"
    return (
        f"{machine['processor']}, {machine['cores']} cores, {machine['system']}, Python {machine['python']}, "
        f"{packages}{limits}."
    )


def figure(value: float) -> str:
    """Return a number with about three digits, and thousands apart."""
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"


def with_quartiles(spread: dict[str, Any]) -> str:
    """Return a median with its quartiles."""
    low, high = spread["quartiles"]
    return f"{figure(spread['median'])} ({figure(low)}–{figure(high)})"


def _label(row: dict[str, Any]) -> str:
    return f"{row['name']}, `{row['preset']}`"


def _by_contestant(document: dict[str, Any]) -> dict[str, dict[int, dict[str, Any]]]:
    """Return the rows of each contestant by size, in the order in which they first appear."""
    found: dict[str, dict[int, dict[str, Any]]] = {}
    for size in document["trials"]:
        for row in size["contestants"]:
            found.setdefault(_label(row), {})[size["remembered"]] = row
    return found


def _trials_table(document: dict[str, Any], quantity: str) -> Table:
    sizes = [size["remembered"] for size in document["trials"]]
    rows = []
    for label, by_size in _by_contestant(document).items():
        cells = [_timed_cell(by_size.get(size, {}), quantity) for size in sizes]
        if any(cell != "–" for cell in cells):
            rows.append([label, *cells])
    n_rounds = sorted({size["n_rounds"] for size in document["trials"]}, reverse=True)
    n_actions = document["parameters"]["trial"]["n_actions"]
    note = (
        "Milliseconds · ratio to `bayes-filter` with the same preset (`learned`: to `default`), medians of "
        f"{' or '.join(map(str, n_rounds))} rounds, quartiles of the ratio."
    )
    remarks = {
        row["name"]: row["remark"]
        for rows in _by_contestant(document).values()
        for row in rows.values()
        if row.get("remark")
    }
    explained = [f"{name}: {remark}." for name, remark in remarks.items()]
    title = QUANTITIES[quantity].format(actions=n_actions, looks=n_actions + 1)
    headings = ["remembered objects", *(f"{size:,}" for size in sizes)]
    more = {"decision": " ".join(explained), "trial": MADE_BEFORE}.get(quantity, "")
    return Table(title, headings, rows, [note, more] if more else [note])


def _timed_cell(row: dict[str, Any], quantity: str) -> str:
    if quantity not in row.get("milliseconds", {}):
        return "–"
    milliseconds = figure(row["milliseconds"][quantity]["median"])
    if (row["name"], row["preset"]) == reference_of(row["preset"]):
        return milliseconds
    return f"{milliseconds} · {with_quartiles(row['ratio'][quantity])}"


def _left_out_table(document: dict[str, Any]) -> Table:
    rows = [
        [_label(row), f"{size['remembered']:,}", row["left_out"]]
        for size in document["trials"]
        for row in size["contestants"]
        if "left_out" in row
    ]
    return Table("Left out, and why", ["contestant", "objects", "reason"], rows)


def _agreement_table(document: dict[str, Any]) -> Table:
    rows = []
    for label, by_size in _by_contestant(document).items():
        found = [row["agreement"] for row in by_size.values() if row.get("agreement")]
        if not found:
            continue
        entropies = [each["expected_entropy"] for each in found if each["expected_entropy"] is not None]
        tolerance = found[0]["tolerance"]
        agrees = [each["agrees"] for each in found]
        rows.append(
            [
                label,
                f"{max(each['identity'] for each in found):.0e}",
                f"{max(entropies):.0e}" if entropies else "not computed",
                "none stated" if tolerance is None else f"{tolerance:.0e}",
                "–" if tolerance is None else "yes" if all(agrees) else "no",
            ]
        )
    headings = ["contestant", "identity", "expected entropy, nats", "tolerance", "within"]
    return Table("Largest difference from `bayes-filter` along the trial, over all sizes", headings, rows)


def _floor_table(document: dict[str, Any]) -> Table:
    timed = {size["remembered"]: size["contestants"] for size in document["trials"]}
    names = [
        (row["name"], row["preset"])
        for size in document["trials"][:1]
        for row in size["contestants"]
        if row["preset"] == "paper" and "agreement" in row
    ]
    rows = []
    for each in document["floor"]:
        least = each["milliseconds"]["floor"]
        medians = {
            (row["name"], row["preset"]): row["milliseconds"]["decision"]["median"]
            for row in timed[each["remembered"]]
            if "milliseconds" in row
        }
        rows.append(
            [
                f"{each['remembered']:,}",
                f"{each['bytes']:,}",
                f"{each['a_second']['bytes']['median'] / 1e9:.1f}",
                f"{each['logarithms']:,}",
                f"{each['a_second']['logarithms']['median'] / 1e6:,.0f}",
                f"{least:.2g}",
                *(figure(medians[name] / least) if name in medians else "–" for name in names),
            ]
        )
    headings = ["objects", "bytes", "GB/s", "logarithms", "10⁶/s", "floor, ms", *(name for name, _ in names)]
    note = (
        "From *floor* on: how many times the floor a decision takes, preset `paper`. Rates are of one core, in NumPy."
    )
    return Table("The floor of a decision", headings, rows, [note])


def _matches_table(document: dict[str, Any]) -> Table:
    matches = document["equal_matches"]
    small, large = (f"{size:,}" for size in matches["sizes"])
    title = f"`{LARGE_MEMORY}` with {matches['matching']} matching objects of {small} and of {large}"
    headings = ["", f"{small}, ms", f"{large}, ms", "ratio"]
    if "left_out" in matches:
        return Table(title, headings, [], [f"Left out: {matches['left_out']}."])
    rows = [
        [
            quantity,
            with_quartiles(matches["milliseconds"]["small"][quantity]),
            with_quartiles(matches["milliseconds"]["large"][quantity]),
            with_quartiles(ratio),
        ]
        for quantity, ratio in matches["ratio"].items()
    ]
    return Table(title, headings, rows, [f"Preset `{matches['preset']}`, {matches['n_rounds']} rounds."])


def _table1_table(document: dict[str, Any]) -> Table:
    measured = document["table1"]
    rows = [
        [
            row["engine"],
            str(row["jobs"]),
            with_quartiles(row["seconds"]),
            with_quartiles(row["ratio"]),
            figure(row["scaled_by"]),
        ]
        for row in measured["engines"]
    ]
    note = (
        f"Preset `default`, {measured['tests']} tests of {measured['trials']} trials, {measured['n_rounds']} rounds; "
        "scaled up to five tests, the start of the processes too."
    )
    return Table("Table 1", ["engine", "processes", "seconds", "ratio", "scaled up by"], rows, [note])


def _start_table(measured: dict[str, Any]) -> Table:
    names = {
        "serial": "a command with one job, from its start to its end",
        "command": "the same with two",
        "added": "what the workers add, by round",
        "first": "the first campaign of a Python process",
        "later": "a later one",
    }
    rows = [
        [words, with_quartiles(measured["seconds"][quantity])]
        for quantity, words in names.items()
        if quantity in measured["seconds"]
    ]
    return Table("The start of two worker processes, with a trial by each", ["", "seconds"], rows, [])


def _against_table(compared: dict[str, Any]) -> Table:
    rows = [
        [
            each["claim"],
            with_quartiles(each["milliseconds"]["before"]),
            with_quartiles(each["milliseconds"]["now"]),
            with_quartiles(each["times_as_quick"]),
            f"≥ {figure(each['target'])}" if each["target"] > 1 else "–",
            "met" if each["met"] else "**missed**",
        ]
        for each in compared["figures"]
    ]
    headings = ["", "before, ms", "now, ms", "times as quick", "target", ""]
    note = f"Before: commit {compared['commit'][:12]}, in an environment of its own with the same libraries."
    return Table(f"The code of revision {compared['revision']}, and that of today", headings, rows, [note])


def _targets_table(document: dict[str, Any]) -> Table:
    met = {True: "met", False: "**missed**", None: "not measured"}
    rows = [
        [each["claim"], "–" if each["found"] is None else f"{figure(each['found'])} {each['unit']}", met[each["met"]]]
        for each in document["targets"]
    ]
    return Table("Targets", ["target", "found", ""], rows)
