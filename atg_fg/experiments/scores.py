"""What is right over the trials of a test, and tables of it."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from atg_fg.core.memory import RobotMemory
from atg_fg.core.records import TrialSummary
from atg_fg.core.statistics import mean, mean_interval, standard_error, wilson_interval
from atg_fg.core.table import ROWS, Bar, Cell, Table, shortened
from atg_fg.learning.duplicates import Duplicate
from atg_fg.learning.structured_memory import StructuredMemory

#: The scores of a test in the paper's Table 1.
SCORES: Final = ("identification", "recognition", "success")


@dataclass(frozen=True)
class TestResult:
    """Scores of one test, in the paper's terms.

    Attributes:
        seed: Seed of the test.
        identification: (trials judged novel if and only if the object was, trials).
        recognition: (of these matched to an ATG made from the object, trials in which an object met before was
            judged known).
        success: (trials right in both, trials).
        lost: Trials that ended because the world lost the object.
        undecided: Trials in which nothing at all was seen.
        actions: Number of actions of each trial.
        merges: (false merges, merges), if duplicates were merged; false are those of ATGs made from two objects.
        mended: (trials whose verdict is right as it was mended, trials learned from), if any trial was given to another
            ATG than its verdict had said.
        right: Whether each trial was a success.
    """

    __test__ = False

    seed: int
    identification: tuple[int, int]
    recognition: tuple[int, int]
    success: tuple[int, int]
    lost: int = 0
    undecided: int = 0
    actions: tuple[int, ...] = ()
    merges: tuple[int, int] | None = None
    mended: tuple[int, int] | None = None
    right: tuple[bool, ...] = ()

    def _repr_html_(self) -> str:
        return table_of_tests([self])._repr_html_()


class Score:
    """Counts what is right over the trials of one test, by the truth rather than by the memory.

    Args:
        made_from: The object that each ATG was made from, by its name, if the memory is not empty at first.
        learns: Whether the memory learns from the trials; if not, an object that was new stays so.
    """

    def __init__(self, made_from: Mapping[str, object] | None = None, *, learns: bool = True) -> None:
        self._learns = learns
        self.n_trials = self.identified = self.recognised = self.judged_known = self.successes = 0
        self.lost = self.undecided = 0
        self._actions: list[int] = []
        self._right: list[bool] = []
        self.merges = self.false_merges = 0
        self._learned_from: list[tuple[object, bool]] = []
        self.mended: int | None = None
        self._made_from: dict[str, object] = dict(made_from or {})
        self._presented: set[object] = set(self._made_from.values())

    def add(self, trial: TrialSummary, learned: str | None, memory: RobotMemory | None = None) -> bool:
        """Score a trial whose record went to the ATG named ``learned``; return whether it was a success.

        A trial without a verdict is no success, but its object was met. What counts is where the memory puts the trial
        when it ends: where looks err, ATGs that it turns out to have mixed up are taken apart at that time, and the
        trial is of an object met before if earlier ones are in its ATG then, of the one that most of these were of.
        """
        self.n_trials += 1
        self.lost += trial.verdict == "lost"
        self.undecided += trial.verdict == "undecided"
        self._actions.append(len(trial.actions))
        seen_before = trial.object in self._presented
        owners = self._mended_owners(memory, 1)
        if learned is None or owners is None:
            verdict: str = trial.verdict
            right_match = trial.matched is not None and self._made_from.get(trial.matched) == trial.object
        else:
            earlier = zip(owners[:-1], self._learned_from, strict=True)
            mates = Counter(presented for owner, (presented, _) in earlier if owner == learned)
            verdict = "known" if mates else "novel"
            right_match = bool(mates) and mates.most_common(1)[0][0] == trial.object
        identified = verdict == ("known" if seen_before else "novel")
        self.identified += identified
        self.judged_known += seen_before and identified
        self.recognised += seen_before and identified and right_match
        success = identified and (right_match or not seen_before)
        self.successes += success
        self._right.append(success)
        if self._learns:
            self._presented.add(trial.object)
        if learned is not None:
            self._learned_from.append((trial.object, seen_before))
            if trial.verdict == "novel":
                self._made_from[learned] = trial.object
        return success

    def mend(self, memory: RobotMemory) -> None:
        """Take note of raw trials that the memory has given to other ATGs than they had been.

        An ATG that took part in this counts as made from the object that most of its trials were of, the first of them
        if there are as many of others. By its mended verdict a trial is of a new object if it is now the first of its
        ATG, else of that ATG's; it is right as one that was given is.
        """
        owners = self._mended_owners(memory, 0)
        if owners is None or not isinstance(memory, StructuredMemory):
            return
        by_name: defaultdict[str, Counter[object]] = defaultdict(Counter)
        for name, (presented, _) in zip(owners, self._learned_from, strict=True):
            by_name[name][presented] += 1
        for name in {name for each in memory.reassignments for name in (each.old, each.new)}:
            if name in by_name:
                self._made_from[name] = by_name[name].most_common(1)[0][0]
        self.mended, begun = 0, set[str]()
        for name, (presented, seen_before) in zip(owners, self._learned_from, strict=True):
            right = self._made_from.get(name) == presented if name in begun else not seen_before
            self.mended += right
            begun.add(name)

    def _mended_owners(self, memory: RobotMemory | None, n_new: int) -> list[str] | None:
        """Return the ATG of each trial, the new ones too, if any has changed hands and all are of this test."""
        if not isinstance(memory, StructuredMemory) or not memory.reassignments:
            return None
        owners = memory.learner.owners
        # Trials from before this test are not scored here.
        return owners if len(owners) == len(self._learned_from) + n_new else None

    def name_of(self, presented: object) -> str | None:
        """Return the name of the first ATG that was made from an object, ``None`` if there is none."""
        return next((name for name, made_from in self._made_from.items() if made_from == presented), None)

    def has_met(self, presented: object) -> bool:
        """Whether an object was presented in a trial before."""
        return presented in self._presented

    def add_merges(self, merged: Sequence[Duplicate]) -> None:
        """Count merges; the merged ATG counts as made from the object of the one that was kept."""
        for each in merged:
            self.merges += 1
            self.false_merges += self._made_from[each.keep] != self._made_from[each.drop]

    def result(self, seed: int, *, merging: bool = False) -> TestResult:
        """Return the scores of the test with this seed, and of its merges if there was merging."""
        return TestResult(
            seed,
            (self.identified, self.n_trials),
            (self.recognised, self.judged_known),
            (self.successes, self.n_trials),
            self.lost,
            self.undecided,
            tuple(self._actions),
            (self.false_merges, self.merges) if merging else None,
            None if self.mended is None else (self.mended, len(self._learned_from)),
            tuple(self._right),
        )


def summarise(results: Iterable[TestResult]) -> dict[str, Any]:
    """Return the tests, their average as the paper takes it (a mean over tests), and intervals.

    Wilson intervals count all trials of all tests as one sample; the standard error, and Student's interval, are over
    tests.
    """
    tests = list(results)
    rates = {
        name: [score[0] / score[1] for score in (getattr(test, name) for test in tests) if score[1] > 0]
        for name in SCORES
    }
    return {
        "tests": [
            {
                "seed": test.seed,
                "identification": list(test.identification),
                "recognition": list(test.recognition),
                "success": test.success[0] / test.success[1],
                "lost": test.lost,
                "undecided": test.undecided,
                **_merges_of([test]),
                **({} if test.mended is None else {"mended": list(test.mended)}),
            }
            for test in tests
        ],
        "average": {name: mean(values) for name, values in rates.items()},
        "standard_error": {name: standard_error(values) for name, values in rates.items()},
        "interval95": {name: list(pooled_interval(tests, name)) for name in rates},
        "between95": {name: _interval_between(values) for name, values in rates.items()},
        "lost": sum(test.lost for test in tests),
        "undecided": sum(test.undecided for test in tests),
        **_merges_of(tests),
        **_mended(tests),
    }


def _interval_between(rates: Sequence[float]) -> list[float] | None:
    """Return Student's 95 % interval of the mean rate of tests, within 0 to 1, ``None`` for fewer than two tests."""
    interval = mean_interval(rates)
    return None if interval is None else [max(interval[0], 0.0), min(interval[1], 1.0)]


def actions_a_trial(results: Iterable[TestResult]) -> dict[str, Any]:
    """Return the mean number of actions of a trial, and its interval: all trials of all tests count as one sample."""
    numbers = [number for test in results for number in test.actions]
    interval = mean_interval(numbers)
    return {"mean": mean(numbers), "interval95": None if interval is None else list(interval)}


def _mended(tests: Sequence[TestResult]) -> dict[str, Any]:
    """Return how many verdicts are right as they were mended, where any was; in a test without they are as given."""
    if all(test.mended is None for test in tests):
        return {}
    counts = [test.success if test.mended is None else test.mended for test in tests]
    right, total = (sum(column) for column in zip(*counts, strict=True))
    return {"mended": {"right": right, "trials": total, "interval95": list(wilson_interval(right, total))}}


def _merges_of(tests: Sequence[TestResult]) -> dict[str, int]:
    """Return the merges of tests, and how many of them were false; nothing if duplicates were not merged."""
    counts = [test.merges for test in tests if test.merges is not None]
    if not counts:
        return {}
    return {"merges": sum(number for _, number in counts), "false_merges": sum(false for false, _ in counts)}


def pooled_interval(tests: Sequence[TestResult], score: str) -> tuple[float, float]:
    """Return the Wilson interval of a score over all trials of all tests."""
    counts = [getattr(test, score) for test in tests]
    return wilson_interval(sum(right for right, _ in counts), sum(number for _, number in counts))


def table_of_tests(tests: Sequence[TestResult], title: str = "") -> Table:
    """Return tests as the paper's Table 1 has them, with the average over tests and intervals over all trials."""
    rows: list[tuple[Cell, ...]] = [
        (str(test.seed), *(_count(getattr(test, score)) for score in SCORES)) for test in tests
    ]
    rows = list(shortened(rows, ROWS, "tests"))
    if len(tests) > 1:
        rows.append(("average", *(_average(tests, score) for score in SCORES)))
    rows.append(("95 % interval", *(_interval(tests, score) for score in SCORES)))
    endings = [f"{number} {name}" for name in ("lost", "undecided") if (number := sum(getattr(t, name) for t in tests))]
    noun = "test" if len(tests) == 1 else "tests"
    return Table(title or f"{len(tests)} {noun}", ("seed", *SCORES), tuple(rows), ", ".join(endings))


def _comparison(compared: Mapping[str, Sequence[TestResult]], title: str) -> Table:
    rows: list[tuple[Cell, ...]] = []
    for name, tests in compared.items():
        cells = [Bar(_average(tests, score).share, _with_interval(tests, score)) for score in SCORES]
        rows.append((name, str(len(tests)), *cells))
    note = "averages over tests; 95 % Wilson intervals over all trials"
    return Table(title or "Tests compared", ("", "tests", *SCORES), tuple(rows), note)


def _count(count: tuple[int, int]) -> Bar:
    right, total = count
    return Bar(right / total if total else 0.0, f"{right}/{total}")


def _average(tests: Sequence[TestResult], score: str) -> Bar:
    counts = [getattr(test, score) for test in tests]
    average = mean([right / total for right, total in counts if total])
    return Bar(average or 0.0, "–" if average is None else f"{100 * average:.1f} %")


def _interval(tests: Sequence[TestResult], score: str) -> str:
    counts = [getattr(test, score) for test in tests]
    total = sum(total for _, total in counts)
    if not total:
        return "–"
    low, high = wilson_interval(sum(right for right, _ in counts), total)
    return f"{100 * low:.1f}–{100 * high:.1f}"


def _with_interval(tests: Sequence[TestResult], score: str) -> str:
    average, interval = _average(tests, score).text, _interval(tests, score)
    return average if interval == "–" else f"{average} ({interval})"
