"""``atg-fg table1`` and ``figure3``, the paper's experiments, and ``ablation``: what each part of the model adds."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from atg_fg.cli import options
from atg_fg.core.checks import MANY, brief
from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.display import figures
from atg_fg.display.success_plots import plot_ablation, plot_success
from atg_fg.experiments.ablation import NOISES, VARIANTS, AblationLog, Cell, run_ablation, summarise_ablation
from atg_fg.experiments.document_tables import tables_of
from atg_fg.experiments.figure3 import Figure3Log, figure3_points
from atg_fg.experiments.scores import TestResult, actions_a_trial, summarise
from atg_fg.experiments.table1 import TestPlan, check_crops, run_tests
from atg_fg.storage import memory_files, plain_files
from atg_fg.storage.checked_json import without_none
from atg_fg.worlds.registry import ARCUBE_WORLDS, WORLDS

#: The average row of Table 1 as printed in the paper (5 tests, 10 actions a trial).
PAPER_TABLE1 = {"identification": 0.816, "recognition": 0.907, "success": 0.792}
#: The two curves of Figure 3.
FIGURE3_POLICIES = ("entropy", "random")


def table1(
    world: options.World = "ideal",
    engine: options.PresetsEngine = None,
    preset: options.Preset = "default",
    policy: options.Policy = "entropy",
    tests: options.Tests = 5,
    actions: options.Actions = 10,
    settled: options.Settled = None,
    trials: options.Trials = 100,
    objects: Annotated[int, typer.Option(help="Objects that there are in the world.")] = 100,
    seed: options.Seed = 0,
    slip: options.Slip = 0.0,
    wrong: options.Wrong = 0.0,
    missing: options.Missing = 0.0,
    condition: options.Condition = None,
    urdf: options.Urdf = None,
    world_option: options.WorldOption = None,
    jobs: options.Jobs = None,
    executor: options.Executor = "process",
    records: Annotated[
        Path | None,
        options.in_running(writable=True, help="Folder, or database (.db), in which every trial is saved as it ends."),
    ] = None,
    crops: Annotated[
        bool,
        options.in_running(
            "--crops", help="Keep beside --records a picture of each class that a trial shows, of boxes with pictures."
        ),
    ] = False,
    smoothed_learning: Annotated[
        bool, options.in_model("--smoothed-learning", help="Learn what is probable given all evidence of a trial.")
    ] = False,
    merge_duplicates: Annotated[
        bool,
        options.in_model("--merge-duplicates", help="After each trial, merge ATGs that are probably of one object."),
    ] = False,
    save_memories: Annotated[
        Path | None,
        options.in_running(
            writable=True,
            help="Folder in which the memory of each test is saved at its end; a database (.db) for one test.",
        ),
    ] = None,
    resume: Annotated[
        bool, options.in_running("--resume", help="Go on after the trials that --records holds.")
    ] = False,
    json_file: options.JsonFile = None,
) -> None:
    """Run the paper's Table 1: tests of 100 trials, each from an empty robot memory.

    Example: atg-fg table1 --preset paper --engine bayes-filter
    """
    workers = options.check_executor_option(executor, jobs)
    if resume and records is None:
        raise InvalidInputError("--resume: no records to go on from; expected --records with their folder")
    if crops:
        check_crops(records)
    if save_memories is not None and memory_files.goes_to_database(save_memories):
        plain_files.check_writable(save_memories)
        if tests > 1:
            raise InvalidInputError(
                f"--save-memories: {save_memories} takes one memory; expected --tests 1 or a folder"
            )
    elif save_memories is not None:
        plain_files.make_folder(save_memories)
    world_options = options.world_options(slip, wrong, missing, condition, urdf, world_option)
    model, engine = options.model_of(preset, engine, "gtsam")
    plan = TestPlan(
        world=world,
        world_options=world_options,
        engine=engine,
        policy=policy,
        parameters=model,
        smoothed_learning=smoothed_learning,
        merge_duplicates=merge_duplicates,
        n_actions=actions,
        n_trials=trials,
        n_objects=objects,
        settled=settled,
    )
    with options.progress_bar("trials", tests * trials) as advance:
        plans = [(plan, seed + test) for test in range(tests)]
        results = run_tests(plans, workers, records, resume, save_memories, executor, on_trials=advance, crops=crops)
    summary = summarise(results)
    if settled is not None:
        summary["actions_a_trial"] = actions_a_trial(results)
    parameters = {
        "world": world,
        "engine": engine,
        "preset": preset,
        "policy": policy,
        "tests": tests,
        "actions": actions,
        "trials": trials,
        **({} if objects == TestPlan.n_objects else {"objects": objects}),
        "seed": seed,
        "slip": slip,
        "wrong": wrong,
        "missing": missing,
        **world_options,
        **without_none(
            {
                "smoothed_learning": smoothed_learning or None,
                "settled": settled,
                "merge_duplicates": merge_duplicates or None,
            }
        ),
    }
    if options.write_json({"command": "table1", "parameters": parameters, **summary}, json_file):
        number = f"{actions} actions" if settled is None else f"up to {actions} actions"
        title = f"Table 1: {world} world, preset {preset}, {policy} policy, {number} a trial, engine {engine}"
        options.console().print(_table1(title, results, summary, beside_paper=world in ARCUBE_WORLDS))


def _table1(title: str, results: Iterable[TestResult], summary: dict[str, Any], *, beside_paper: bool) -> Table:
    """Return the paper's table; with the paper's own average below ours, if the objects are the paper's."""
    table = Table(title=title, title_justify="left")
    for heading in ("Test", "Correct identification", "Correct recognition", "Success rate"):
        table.add_column(heading, justify="right" if heading != "Test" else "left")
    for number, result in enumerate(results, start=1):
        counts = [f"{right}/{total}" for right, total in (result.identification, result.recognition)]
        table.add_row(str(number), *counts, f"{100 * result.success[0] / result.success[1]:.0f}%")
    table.add_section()
    scores = ("identification", "recognition", "success")
    table.add_row("average", *(_percent(summary["average"][score]) for score in scores), style="bold")
    intervals = (summary["interval95"][score] for score in scores)
    table.add_row("95% interval", *map(_share_interval, intervals))
    between = [summary["between95"][score] for score in scores]
    if any(between):
        table.add_row("between tests", *("-" if each is None else _share_interval(each) for each in between))
    if "actions_a_trial" in summary:
        table.add_row("actions a trial", _mean_with_interval(summary["actions_a_trial"]))
    for ending in ("lost", "undecided"):
        if summary[ending]:
            table.add_row(f"{ending} trials", str(summary[ending]))
    if "mended" in summary:
        mended = summary["mended"]
        share = f"{mended['right']}/{mended['trials']} ({100 * mended['right'] / mended['trials']:.1f}%)"
        table.add_row("right after mending", "", "", share)
    if "merges" in summary:
        table.add_row("merged ATGs", str(summary["merges"]), f"{summary['false_merges']} falsely")
    if beside_paper:
        table.add_row("paper", *(_percent(PAPER_TABLE1[score]) for score in scores))
    return table


def _share_interval(interval: Sequence[float]) -> str:
    low, high = interval
    return f"{100 * low:.1f}-{100 * high:.1f}%"


def _mean_with_interval(number: dict[str, Any]) -> str:
    if number["interval95"] is None:
        return f"{number['mean']:.2f}"
    low, high = number["interval95"]
    return f"{number['mean']:.2f} ({low:.2f}-{high:.2f})"


def _percent(rate: float | None) -> str:
    return "-" if rate is None else f"{100 * rate:.1f}%"


def figure3(
    actions: Annotated[str, typer.Option(help="Numbers of actions, first:last or a list such as 4,6,10.")] = "4:20",
    tests: options.Tests = 10,
    world: options.World = "ideal",
    engine: options.PresetsEngine = None,
    preset: options.Preset = "default",
    trials: options.Trials = 100,
    seed: options.Seed = 0,
    slip: options.Slip = 0.0,
    wrong: options.Wrong = 0.0,
    missing: options.Missing = 0.0,
    jobs: options.Jobs = None,
    executor: options.Executor = "process",
    json_file: options.JsonFile = None,
    log: options.Log = None,
    csv_file: Annotated[
        Path | None, options.written("--csv", help="Write the points as CSV to this file."), plain_files.check_writable
    ] = None,
    plot: options.Plot = None,
) -> None:
    """Run the paper's Figure 3: success of the entropy and the random policy by number of actions.

    Example: atg-fg figure3 --actions 4:20 --tests 10 --plot figure3.png --csv figure3.csv
    """
    numbers = parse_actions(actions)
    workers = options.check_executor_option(executor, jobs)
    model, engine = options.model_of(preset, engine, "bayes-filter")
    plan = TestPlan(
        world=world,
        world_options=options.world_options(slip, wrong, missing),
        engine=engine,
        parameters=model,
        n_trials=trials,
    )
    kept = None if log is None else Figure3Log(log, plan)
    seeds = range(seed, seed + tests)
    with options.progress_bar("trials", len(numbers) * len(FIGURE3_POLICIES) * tests * trials) as advance:
        points = figure3_points(plan, numbers, FIGURE3_POLICIES, seeds, workers, advance, kept, executor)
    parameters = {
        "world": world,
        "engine": engine,
        "preset": preset,
        "actions": numbers,
        "tests": tests,
        "trials": trials,
        "seed": seed,
        "slip": slip,
        "wrong": wrong,
        "missing": missing,
    }
    document = {"command": "figure3", "parameters": parameters, "points": points}
    options.write_json(document, json_file)
    if csv_file is not None:
        plain_files.write_bytes_atomically(csv_file, _csv(points).encode())
    if plot is not None:
        figures.save_figure(plot_success(points, title=f"Figure 3: {world} world, preset {preset}"), plot)
    if json_file != "-":
        title = f"Figure 3: success, {world} world, preset {preset}, {tests} tests of {trials} trials"
        options.print_tables(tables_of(document), title)


def parse_actions(text: str) -> list[int]:
    """Return the numbers of actions in ``first:last`` or in a list with commas.

    Raises:
        InvalidInputError: Not in one of these forms, a number below one, or first above last.
    """
    parts = text.split(":") if ":" in text else text.split(",")
    try:
        numbers = [int(part) for part in parts]
    except ValueError:
        numbers = []
    if ":" in text:
        numbers = [*range(max(numbers[0], 0), min(numbers[1], MANY + 1) + 1)] if len(numbers) == 2 else []
    if not numbers or min(numbers) < 1 or max(numbers) > MANY or len(set(numbers)) != len(numbers):
        raise InvalidInputError(
            f"--actions: {brief(text)}; expected first:last or a list such as 4,6,10, all from 1 to {MANY}"
        )
    return numbers


def _csv(points: list[dict[str, Any]]) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["actions", "policy", "success", "low95", "high95", "standard_error", "tests"])
    for point in points:
        row = [point[key] for key in ("actions", "policy", "success")]
        writer.writerow([*row, *point["interval95"], point["standard_error"], point["tests"]])
    return text.getvalue()


def ablation(
    variants: Annotated[
        str, typer.Option(help=f"all, or some of: {'; '.join(VARIANTS)} (with ; between them).")
    ] = "all",
    actions: Annotated[str, typer.Option(help="Numbers of actions, first:last or a list.")] = "3,4,6,8,10,14,20",
    noises: Annotated[str, typer.Option(help=f"all, or some of: {'; '.join(NOISES)} (with ; between them).")] = "all",
    worlds: Annotated[str, typer.Option(help=f"Some of: {', '.join(WORLDS)}.")] = "ideal",
    tests: options.Tests = 10,
    trials: options.Trials = 100,
    seed: options.Seed = 0,
    jobs: options.Jobs = None,
    executor: options.Executor = "process",
    log: options.Log = None,
    json_file: options.JsonFile = None,
    plot: options.Plot = None,
) -> None:
    """Compare the literal model, learning within the trial, learned structure and lookahead, with and without noise.

    Example: atg-fg ablation --actions 4,10 --noises ideal --tests 2 --log ablation.jsonl
    """
    workers = options.check_executor_option(executor, jobs)
    cells = [
        Cell(variant, world, noise, number)
        for world in _chosen("--worlds", worlds, tuple(WORLDS), ",")
        for noise in _chosen("--noises", noises, tuple(NOISES), ";")
        for variant in _chosen("--variants", variants, tuple(VARIANTS), ";")
        for number in parse_actions(actions)
    ]
    kept = None if log is None else AblationLog(log, trials)
    with options.progress_bar("trials", len(cells) * tests * trials) as advance:
        seeds = range(seed, seed + tests)
        results = run_ablation(cells, seeds, trials, kept, workers, advance, executor)
    entries = summarise_ablation(results)
    parameters = {"tests": tests, "trials": trials, "seed": seed}
    document = {"command": "ablation", "parameters": parameters, "cells": entries}
    options.write_json(document, json_file)
    if plot is not None:
        figures.save_figure(plot_ablation(entries), plot)
    if json_file != "-":
        places = dict.fromkeys((each["world"], each["noise"]) for each in entries)
        titles = [f"Success, {world} world, {noise}, {tests} tests of {trials} trials" for world, noise in places]
        options.print_tables(tables_of(document), *titles)


def _chosen(option: str, text: str, known: tuple[str, ...], separator: str) -> list[str]:
    """Return the names in an option's text, or all that there are.

    Raises:
        UnknownNameError: A name that is not there.
        InvalidInputError: A name twice.
    """
    if text == "all":
        return list(known)
    names = [name.strip() for name in text.split(separator)]
    for name in names:
        if name not in known:
            raise unknown_name(option, name, known)
    if len(set(names)) < len(names):
        raise InvalidInputError(f"{option}: {text!r}; expected each name once")
    return names
