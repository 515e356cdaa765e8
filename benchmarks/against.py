"""This project's own code of another revision, timed round by round beside the present one.

``python -m benchmarks.against REVISION WORD`` times those figures alone whose claim has a word, such as ``learned``.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import sysconfig
import tempfile
import venv
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from atg_fg.core.errors import InvalidInputError
from benchmarks.measuring import Sample, alternate, ratios, spread

ROOT: Final = Path(__file__).parents[1]


@dataclass(frozen=True)
class Figure:
    """What is compared.

    Attributes:
        claim: In words.
        turn: Name and arguments of a turn of ``benchmarks.turns``.
        quantity: What of it.
        target: How many times as quick the present code is meant to be.
        rounds: How often, at most.
    """

    claim: str
    turn: tuple[str, dict[str, Any]]
    quantity: str
    target: float
    rounds: int = 5


def _trial(engine: str, preset: str, n_objects: int, repeats: int = 1) -> tuple[str, dict[str, Any]]:
    return "trial", {"engine": engine, "preset": preset, "n_objects": n_objects, "repeats": repeats}


_AT_100, _AT_1000 = _trial("bayes-filter", "default", 100, 9), _trial("bayes-filter", "default", 1_000, 5)
_AT_10000, _AT_100000 = _trial("bayes-filter", "default", 10_000), _trial("bayes-filter", "default", 100_000)
_LARGE = _trial("large-memory", "default", 100_000)
FIGURES: Final = (
    Figure("`bayes-filter`, `default`: filter step at 100", _AT_100, "step", 4),
    Figure("`bayes-filter`, `default`: filter step at 1,000", _AT_1000, "step", 4),
    Figure("`bayes-filter`, `default`: decision at 100", _AT_100, "decision", 1),
    Figure("`bayes-filter`, `default`: decision at 1,000", _AT_1000, "decision", 1),
    Figure("`bayes-filter`, `default`: decision at 10,000", _AT_10000, "decision", 3),
    Figure("`bayes-filter`, `default`: trial of 10 actions at 10,000, begin included", _AT_10000, "trial", 5),
    Figure("`bayes-filter`, `default`: decision at 100,000", _AT_100000, "decision", 3, 3),
    Figure("`gtsam`, `default`: decision at 100", _trial("gtsam", "default", 100, 3), "decision", 2),
    Figure("`large-memory`, `default`: first decision at 100,000 cubes", _LARGE, "first decision", 2, 3),
    Figure("`large-memory`, `default`: last decision at 100,000 cubes", _LARGE, "last decision", 2, 3),
    Figure(
        "a test of 100 trials, `bayes-filter`, `default`, one core",
        ("test", {"engine": "bayes-filter", "parameters": "default", "n_trials": 100}),
        "seconds",
        3,
    ),
    Figure(
        "a test of 100 trials, `learned-structure`, `learned`, one core",
        ("test", {"engine": "learned-structure", "parameters": "learned", "n_trials": 100}),
        "seconds",
        3,
        3,
    ),
    Figure(
        "Figure 3 with four tests a point, two processes",
        ("figure3", {"n_trials": 100, "n_tests": 4}),
        "seconds",
        4,
        2,
    ),
)
#: A look at whether it runs.
QUICK: Final = (
    Figure("`bayes-filter`, `default`: filter step at 10", _trial("bayes-filter", "default", 10), "step", 1),
)


class Side:
    """A process with the library of one environment.

    Args:
        python: The environment's interpreter.
        home: Folder of the library's code; it comes before whatever else is on the path.
    """

    def __init__(self, python: Path, home: Path = ROOT) -> None:
        # Without -P the folder of the script, with the modules of the present revision, would come first.
        command = [str(python), "-P", str(ROOT / "benchmarks" / "turns.py")]
        environment = {**os.environ, "PYTHONPATH": str(home)}
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment
        )

    def turn(self, name: str, arguments: dict[str, Any]) -> Sample:
        """Return the median of each quantity of a turn."""
        process = self._process
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(json.dumps([name, arguments]) + "\n")
        process.stdin.flush()
        line = process.stdout.readline()
        if not line:
            raise RuntimeError(f"{process.args!r} ended in turn {name!r}")
        return {quantity: statistics.median(values) for quantity, values in json.loads(line).items()}

    def __enter__(self) -> Side:
        return self

    def __exit__(self, *error: object) -> None:
        self._process.communicate()


def commit_of(revision: str) -> str:
    """Return the commit that a revision names.

    Raises:
        InvalidInputError: This is no checkout of the project, or it has no such revision.
    """
    command = ["git", "-C", str(ROOT), "rev-parse", "--verify", "--quiet", "--end-of-options", f"{revision}^{{commit}}"]
    try:
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    except FileNotFoundError as error:
        raise InvalidInputError("--against: git is not installed; expected it, and a checkout") from error
    if done.returncode:
        raise InvalidInputError(f"--against: {revision!r}; expected a revision in the repository at {ROOT}")
    return done.stdout.strip()


@contextmanager
def built(commit: str) -> Iterator[tuple[Path, Path]]:
    """Yield the interpreter of an environment with all libraries of this one, and the code of a commit."""
    with tempfile.TemporaryDirectory() as name:
        tree, environment = Path(name) / "tree", Path(name) / "environment"
        tree.mkdir()
        archive = subprocess.run(["git", "-C", str(ROOT), "archive", commit], capture_output=True, check=True)
        subprocess.run(["tar", "-x", "-C", str(tree)], input=archive.stdout, check=True)
        venv.create(environment, symlinks=True)
        python = environment / "bin" / "python"
        asked = "import sysconfig; print(sysconfig.get_path('purelib'))"
        there = subprocess.run([str(python), "-c", asked], capture_output=True, text=True, check=True).stdout.strip()
        here = [path for path in sys.path if path and Path(path).name in ("site-packages", "dist-packages")]
        (Path(there) / "revision.pth").write_text("\n".join([*here, sysconfig.get_path("platlib")]) + "\n")
        yield python, tree


def measure(
    revision: str, figures: tuple[Figure, ...] = FIGURES, on_part: Callable[[str], None] = lambda _: None
) -> dict[str, Any]:
    """Time both revisions, a round after the other.

    Args:
        revision: The earlier one.
        figures: What is compared.
        on_part: Told each figure before it is measured.

    Raises:
        InvalidInputError: There is no such revision.
    """
    commit, rows = commit_of(revision), []
    with built(commit) as earlier, Side(*earlier) as before, Side(Path(sys.executable)) as now:
        taken: dict[str, dict[str, dict[str, list[float]]]] = {}
        for figure in figures:
            key = json.dumps(figure.turn)
            if key not in taken:
                on_part(figure.claim)
                sides = {"before": before, "now": now}
                turns = {name: _turn(side, figure) for name, side in sides.items()}
                for turn in turns.values():
                    turn()  # not counted: loops are compiled, and memories made
                taken[key] = alternate(turns, figure.rounds)
            seconds = {name: samples[figure.quantity] for name, samples in taken[key].items()}
            quicker = spread(ratios(seconds["before"], seconds["now"]))
            rows.append(
                {
                    "claim": figure.claim,
                    "milliseconds": {name: spread([1e3 * each for each in own]) for name, own in seconds.items()},
                    "times_as_quick": quicker,
                    "target": figure.target,
                    "met": quicker["median"] >= figure.target,
                }
            )
    return {"revision": revision, "commit": commit, "figures": rows}


def _turn(side: Side, figure: Figure) -> Callable[[], Sample]:
    name, arguments = figure.turn
    return lambda: side.turn(name, arguments)


def peak_bytes(n_objects: int) -> float:
    """Return the most memory that a process holds in a trial of ``bayes-filter`` with so many objects."""
    with Side(Path(sys.executable)) as side:
        side.turn(*_trial("bayes-filter", "default", n_objects))
        return side.turn("peak", {})["bytes"]


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("expected a revision and a word: python -m benchmarks.against c7ddf6f learned")
    for row in measure(sys.argv[1], tuple(each for each in FIGURES if sys.argv[2] in each.claim))["figures"]:
        print(row["claim"], row["times_as_quick"], "times as quick; ms:", row["milliseconds"])
