"""The cases: what is run, each in an empty folder with the inputs in it, and what is compared.

A case is one or more command lines. Compared are the standard output of each, but for what ``drop`` names, and the
files in ``outputs``. Nothing here knows modules of the library: commands alone are called.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

#: Where a command of the cases below is found today; the transcripts keep the words on the left.
COMMAND_WORDS: Final[dict[str, str]] = {
    "compare": "engines compare",
    "calibrate": "engines check",
    "structure show": "memory structure",
}

EXACT_ENGINES: Final = (
    "bayes-filter",
    "enumeration",
    "gtsam",
    "gtsam-marginals",
    "gtsam-multifrontal",
    "gtsam-sequential",
)
#: All but ``learned-structure``; engines that are added later are none of this test's business.
ENGINES: Final = (*EXACT_ENGINES, "gibbs", "large-memory", "loopy-bp", "mean-field", "particle")
SCRIPTS: Final = " ".join(f"script-{number}.json" for number in range(10))
#: A memory file of each form and version that was ever written.
MEMORIES: Final = ("memory-1.json", "memory-1-structured.json", "memory-schema-1.db", "memory-compact-1.npz")


@dataclass(frozen=True)
class Case:
    """One case.

    Attributes:
        name: Of the case, and of its file in ``data/``.
        commands: Command lines without the program's name, run one after the other in the same folder.
        outputs: Files whose content is compared; of an HTML page, its data.
        drop: Keys that are taken out of JSON on standard output: times.
        slow: Whether it is left to `make test-all`.
    """

    name: str
    commands: tuple[str, ...]
    outputs: tuple[str, ...] = ()
    drop: tuple[str, ...] = ()
    slow: bool = False

    @property
    def part(self) -> str:
        """``learned`` for what preset ``learned`` gives, which may be changed on purpose; else ``rest``."""
        return "learned" if self.name.startswith("learned") else "rest"


def _table1(preset: str, options: str) -> str:
    return f"table1 --preset {preset} {options} --jobs 1 --json -"


#: Of a comparison: what differs from run to run, and errors look by look, whose mean is kept.
COSTS = ("time_ratio", "seconds", "reference_seconds", "errors")


def _compare(engines: tuple[str, ...], options: str) -> str:
    return f"compare {options} --engines {','.join(engines)} --json -"


def _trials(options: str) -> tuple[str, ...]:
    """Commands: four trials that are learned one after the other, three of them of an object that was met."""
    saved = "--save-memory memory.json --record trial.jsonl --json -"
    first = f"trial {options} --seed 0 {saved}"
    return first, *(f"trial {options} --memory memory.json --seed {seed} {saved}" for seed in (1, 0, 1))


def _memory(file: str) -> tuple[str, ...]:
    """Commands: all that can be asked of a memory, whatever file it is in."""
    formats = ("json", "graphml", "dot", *(["trials"] if file.endswith(".db") else []))
    compared = () if file.endswith(".npz") else (f"diff memory-1.json {file}", f"duplicates {file}")
    return (
        *(f"memory {asked} {file}" for asked in ("show", "show --json -", "check", "check --json -")),
        *(f"memory export {file} --format {form}" for form in formats),
        *(f"memory {command} --json -" for command in compared),
    )


CASES: Final = (
    *(
        Case(f"table1-{preset}", (_table1(preset, "--tests 3 --engine bayes-filter"),))
        for preset in ("paper", "default")
    ),
    Case("table1-usual-engine", (_table1("default", "--tests 2 --trials 10"),)),
    Case("table1-noise", (_table1("default", "--tests 1 --trials 50 --slip 0.05 --wrong 0.01 --missing 0.05"),)),
    Case("learned-table1-short", (_table1("learned", "--tests 2 --trials 20"),)),
    Case("learned-table1", (_table1("learned", "--tests 3"),), slow=True),
    Case("figure3", ("figure3 --actions 4,10 --tests 2 --trials 20 --engine bayes-filter --jobs 1 --json -",)),
    Case("goal", ("goal --trials 5 --engine bayes-filter --jobs 1 --json -",)),
    Case(
        "goal-explore",
        ("goal --trials 2 --planner value-iteration --unreachable explore --jobs 1 --json -",),
        slow=True,
    ),
    Case("learned-goal", ("goal --trials 2 --preset learned --memory-cubes 10 --jobs 1 --json -",), slow=True),
    Case("compare-short", (_compare(ENGINES, "--trials 1 --actions 2"),), drop=COSTS),
    Case("compare", (_compare(ENGINES, "--trials 5"),), drop=COSTS, slow=True),
    Case("learned-compare", (_compare(("learned-structure",), "--trials 2"),), drop=COSTS),
    Case("calibrate", ("calibrate --trials 200 --json -",)),
    *(Case(f"replay-{engine}", (f"replay {SCRIPTS} --engine {engine} --smooth",)) for engine in EXACT_ENGINES),
    Case(
        "explain",
        (
            *(f"explain script-{number}.json --k 3 --samples 3 --smooth --json -" for number in range(10)),
            "explain script-9.json --k 2",
        ),
    ),
    Case(
        "uai",
        (
            "uai export script-3.json --model trial.uai --evidence trial.uai.evid",
            *(f"uai solve trial.uai --evidence trial.uai.evid --task {task}" for task in ("MAR", "PR", "MPE")),
            *(f"uai solve grid.uai --evidence grid.uai.evid --task {task} --json -" for task in ("MAR", "PR", "MPE")),
        ),
        outputs=("trial.uai", "trial.uai.evid"),
    ),
    *(Case(f"memory-{file.replace('.', '-').removeprefix('memory-')}", _memory(file)) for file in MEMORIES),
    Case(
        "learned-structure",
        (
            "structure show memory-1-structured.json --json -",
            "memory export memory-1-structured.json --format dot --completed",
        ),
    ),
    Case(
        "memory-moved",
        (
            "memory merge memory-1.json memory-schema-1.db --output merged.json",
            "memory import memory-1-structured.json --into robot.db",
            "memory compact memory-1.json --output compact.npz --json -",
            "memory export robot.db --format json",
            "memory export compact.npz --format json",
        ),
        outputs=("merged.json",),
    ),
    Case("trial", _trials("--preset default --actions 6"), outputs=("trial.jsonl", "memory.json")),
    Case(
        "learned-trial",
        (*_trials("--preset learned --actions 6"), "structure show memory.json --json -"),
        outputs=("trial.jsonl", "memory.json"),
    ),
    Case(
        "report-trial",
        (*_trials("--preset default --actions 6"), "report trial.jsonl --memory memory.json -o page.html"),
        outputs=("page.html",),
    ),
    Case(
        "report-table1",
        (
            "table1 --tests 2 --trials 10 --engine bayes-filter --jobs 1 --json result.json",
            "report result.json -o page.html",
        ),
        outputs=("page.html",),
    ),
    *(
        Case(f"report-{name}", (f"report {file} -o page.html",), outputs=("page.html",))
        for name, file in (
            ("test", "test-1.jsonl.gz"),
            ("goal-run", "goal-run-1.json.gz"),
            ("database", "memory-schema-1.db"),
        )
    ),
)
