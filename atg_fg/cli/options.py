"""Options that several commands share, and how results leave the command line."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import Annotated, Any

import rich.table
import typer
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from atg_fg.cli.terminal import PlainConsole
from atg_fg.core.checks import MANY
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.table import Table
from atg_fg.display import figures
from atg_fg.engines import ENGINES, engine_for, usual_engine
from atg_fg.experiments.executors.base import EXECUTORS, check_executor, is_cluster
from atg_fg.policies import POLICIES, check_entropy_threshold
from atg_fg.storage import plain_files
from atg_fg.storage.presets import PRESETS
from atg_fg.storage.presets import preset as preset_named
from atg_fg.worlds.base import probability_option
from atg_fg.worlds.registry import ARCUBE_WORLDS, WORLDS


def available_cpus() -> int:
    """Return the number of processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _checked_entropy(settled: Any) -> Any:
    return None if settled is None else check_entropy_threshold(settled, "--settled")


#: Options in the panels of the help page; what is in none of them stands in the first one, without a name.
in_world, in_model, in_trials, in_running = (
    partial(typer.Option, rich_help_panel=panel) for panel in ("World", "Model", "Trials", "Running")
)
#: An argument of a command; it has no default that a help page could show.
argument = partial(typer.Argument, show_default=False)
#: An option for what a command writes to: see ``atg_fg.cli.paths``.
written = partial(typer.Option, writable=True)

MemoryFile = Annotated[Path, argument(help="A memory: JSON, or a database.")]
World = Annotated[str, in_world(help=f"World: {', '.join(WORLDS)}, or module:namespace/Id-v0 of your own.")]
DemoWorld = Annotated[
    str,
    in_world(
        help=f"World of ARcubes: {', '.join(ARCUBE_WORLDS)}, or module:namespace/Id-v0 of your own; or picture-box."
    ),
]
ARcubeWorld = Annotated[
    str, in_world(help=f"World of ARcubes: {', '.join(ARCUBE_WORLDS)}, or module:namespace/Id-v0 of your own.")
]
Engine = Annotated[str, typer.Option(help=f"Inference engine: {', '.join(ENGINES)}.")]
PresetsEngine = Annotated[
    str | None, in_model(help=f"Inference engine: {', '.join(ENGINES)}. The preset's usual one if not given.")
]
Preset = Annotated[str, in_model(help=f"Model parameters: {', '.join(PRESETS)}, or a .json file of your own.")]
Policy = Annotated[str, in_model(help=f"Policy: {', '.join(POLICIES)}, or module:object of your own.")]
Settled = Annotated[
    float | None,
    in_trials(
        help="End a trial when the entropy of the verdict is at most this, nats; --actions is then the most.",
        callback=_checked_entropy,
    ),
]
Seed = Annotated[int, in_trials(min=0, help="Seed; test number k uses seed + k.")]
Actions = Annotated[int, in_trials(min=1, max=MANY, help="Actions a trial.")]
Tests = Annotated[int, in_trials(min=1, max=MANY, help="Number of tests.")]
Trials = Annotated[int, in_trials(min=1, max=MANY, help="Trials a test.")]
Jobs = Annotated[
    int | None,
    in_running(min=1, help="Processes or threads; the result is the same for any number. All processors if not given."),
]
Executor = Annotated[
    str, in_running(help=f"Where tests or runs are done: {EXECUTORS}; the result is the same anywhere.")
]
Log = Annotated[
    Path | None,
    in_running(writable=True, help="Keep each test in this .jsonl file as it ends, and leave out those in it."),
    plain_files.check_writable,
]
JsonFile = Annotated[
    str | None,
    written("--json", help="Write the result as JSON to this file, or - to print it."),
    plain_files.check_writable,
]
Plot = Annotated[
    Path | None, written(help="Draw the result into this .png, .svg or .pdf file."), figures.check_figure_path
]
Slip = Annotated[float, in_world(help="Probability that an action fails and the object stays as it is.")]
Wrong = Annotated[float, in_world(help="Probability that a look shows a pattern drawn at random.")]
Missing = Annotated[float, in_world(help="Probability, a slot, that its symbol is not detected.")]
Condition = Annotated[
    str | None, in_world(help="What the robot works under: nominal or worn (world robonaut; nominal if not given).")
]
Urdf = Annotated[Path | None, in_world(help="Your own robot, URDF as NASA's or a mapping, TOML (world robonaut).")]

WorldOption = Annotated[
    list[str] | None,
    in_world(help="An option of the world's own, NAME=VALUE, such as n_successors=1; may be given again."),
]


def world_options(
    slip: float = 0.0,
    wrong: float = 0.0,
    missing: float = 0.0,
    condition: str | None = None,
    urdf: Path | None = None,
    own: Sequence[str] | None = None,
) -> dict[str, Any]:
    """Return the options for the world that are not zero and given; ``own`` are those written NAME=VALUE."""
    noise = {"slip": slip, "wrong": wrong, "missing": missing}
    given: dict[str, Any] = {name: probability_option(f"--{name}", value) for name, value in noise.items() if value}
    if condition is not None:
        given["condition"] = condition
    if urdf is not None:
        given["urdf"] = str(urdf)
    return {**given, **dict(_own_option(text) for text in own or ())}


def _own_option(text: str) -> tuple[str, Any]:
    """Return name and value of an option written NAME=VALUE; a value that is no JSON is text."""
    name, separator, value = text.partition("=")
    if not name.isidentifier() or not separator:
        raise InvalidInputError(f"--world-option: {text!r}; expected NAME=VALUE, such as n_successors=1")
    try:
        return name, json.loads(value)
    except ValueError:
        return name, value


def model_of(preset: str, engine: str | None, usual: str) -> tuple[ModelParameters, str]:
    """Return a preset's parameters, and the engine: the one asked for, or else the usual one, or the one they need.

    Raises:
        UnknownNameError: There is no such preset or engine.
        InvalidInputError: The preset cannot be read, or the engine is none or does not know what the preset asks for.
    """
    parameters = preset_named(preset)
    chosen = usual_engine(parameters, usual) if engine is None else engine
    engine_for(chosen, parameters)
    return parameters, chosen


def check_executor_option(executor: str, jobs: int | None) -> int:
    """Refuse an executor that is none; return the number of processes or threads, all processors if not given."""
    check_executor(executor, "--executor")
    if jobs is not None and is_cluster(executor):
        raise InvalidInputError(f"--jobs: {jobs}; expected none with --executor {executor}, which has its own workers")
    return jobs or available_cpus()


def write_json(document: dict[str, Any], path: str | None) -> bool:
    """Write a result to ``path``, if given, or print it if that is ``-``; return whether it is to be told in words."""
    text = "" if path is None else json.dumps(document, indent=1, allow_nan=False) + "\n"
    if path == "-":
        sys.stdout.write(text)
    elif path is not None:
        plain_files.write_bytes_atomically(path, text.encode())
    return path != "-"


def console(json_path: str | None = None) -> PlainConsole:
    """Return where tables go: standard output, or standard error if that is taken by JSON."""
    return PlainConsole(stderr=json_path == "-")


def print_tables(tables: Iterable[Table], *titles: str) -> None:
    """Print tables on standard output, the first ones with other titles if any are given."""
    for table, title in zip_longest(tables, titles):
        shown = rich.table.Table(title=title or table.title or None, title_justify="left", caption=table.note or None)
        for number, heading in enumerate(table.headings):
            shown.add_column(heading, justify="right" if number else "left")
        for row in table.rows:
            shown.add_row(*map(str, row))
        console().print(shown)


@contextmanager
def progress_bar(description: str, total: int) -> Iterator[Any]:
    """Show a progress bar on a terminal; give a function that advances it, by one if no number is given."""
    error_console = PlainConsole(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=error_console, transient=True, disable=not error_console.is_terminal) as progress:
        task = progress.add_task(description, total=total)
        yield lambda number=1: progress.advance(task, number)
