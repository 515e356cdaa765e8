"""``atg-fg ablation``: what each part of the model adds."""

from __future__ import annotations

from typing import Annotated

import typer

from atg_fg.cli import options
from atg_fg.cli.experiments import parse_actions
from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.display import figures
from atg_fg.display.success_plots import plot_ablation
from atg_fg.experiments.ablation import NOISES, VARIANTS, AblationLog, Cell, run_ablation, summarise_ablation
from atg_fg.experiments.document_tables import tables_of
from atg_fg.worlds.registry import WORLDS


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
