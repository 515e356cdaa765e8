"""``atg-fg engines``: the inference engines held against each other and against the model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any

import typer

from atg_fg.cli import options
from atg_fg.cli.terminal import say
from atg_fg.core.checks import MANY, whole_number
from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.core.recordings import assumptions_for
from atg_fg.display import figures
from atg_fg.display.comparison_plot import plot_comparison
from atg_fg.engines import ENGINES, engine_for
from atg_fg.engines.options import name_and_options, named_engines
from atg_fg.experiments import calibration, engine_comparison
from atg_fg.experiments.document_tables import tables_of
from atg_fg.storage.memory_files import load_memory
from atg_fg.storage.presets import preset as preset_named
from atg_fg.storage.recordings import read_recording

app = typer.Typer(
    help="Compare inference engines, and check that one is calibrated. Example: atg-fg engines compare",
    no_args_is_help=True,
)


@app.command()
def compare(
    trials: Annotated[str, typer.Option(help="Number of trials; or a recording of your own, with --memory.")] = "50",
    memory: Annotated[
        Path | None, typer.Option(help="A memory of your own; one of random cubes if not given.", show_default=False)
    ] = None,
    engines: Annotated[
        str, typer.Option(help=f"all, or a list such as gtsam,particle(n_particles=500). {', '.join(ENGINES)}.")
    ] = "all",
    objects: Annotated[int, typer.Option(help="Objects that exist.")] = 100,
    remembered: Annotated[int, typer.Option(help="Objects in the memory.")] = 20,
    actions: options.Actions = 6,
    preset: options.Preset = "default",
    slip: options.Slip = 0.0,
    wrong: options.Wrong = 0.0,
    missing: options.Missing = 0.0,
    seed: options.Seed = 0,
    json_file: options.JsonFile = None,
    plot: options.Plot = None,
) -> None:
    """Compare inference engines on the same trials: error against exact, decisions, and cost.

    Example: atg-fg engines compare --trials 10 --engines "bayes-filter,particle(n_particles=500)"
    """
    names = list(ENGINES) if engines == "all" else named_engines(engines)
    for name in names:
        if (bare := name_and_options(name)[0]) not in ENGINES and ":" not in bare:
            raise unknown_name("engine", bare, ["all", *ENGINES])
    parameters = preset_named(preset)
    given: dict[str, Any]
    if memory is None:
        plan = engine_comparison.ComparisonPlan(
            n_trials=_number_of_trials(trials),
            n_actions=actions,
            n_objects=objects,
            n_remembered=remembered,
            parameters=parameters,
            world_options=options.world_options(slip, wrong, missing),
        )
        with options.progress_bar("trials", plan.n_trials) as advance:
            records = engine_comparison.compare(plan, names, seed, advance)
        given = {"trials": plan.n_trials, "objects": objects, "remembered": remembered, "actions": actions}
        given |= {"preset": preset, "slip": slip, "wrong": wrong, "missing": missing, "seed": seed}
        title = f"{trials} trials of {actions} actions, {remembered} of {objects} objects remembered, preset {preset}"
    else:
        held, recording = load_memory(memory), read_recording(trials)
        held = held.extended(assumptions_for(recording, held.assumptions).alphabet.names)
        with options.progress_bar("trials", len(recording.trials)) as advance:
            records = engine_comparison.compare_engines(names, held, recording.trials, parameters, advance)
        given = {"trials": trials, "memory": str(memory), "preset": preset}
        title = f"{len(recording.trials)} trials of {trials}, memory {memory}, preset {preset}"
    document = {"command": "compare", "parameters": given, "engines": engine_comparison.summarise(records)}
    options.write_json(document, json_file)
    if plot is not None:
        figures.save_figure(plot_comparison(records), plot)
    if json_file != "-":
        options.print_tables(tables_of(document), title)


def _number_of_trials(trials: str) -> int:
    try:
        number = int(trials)
    except ValueError:
        raise InvalidInputError(
            f"--trials: {trials!r}; expected a number, or a recording together with --memory"
        ) from None
    return whole_number(number, "--trials", 1, MANY)


@app.command()
def check(
    engine: options.Engine = "bayes-filter",
    trials: Annotated[int, typer.Option(min=2, help="Number of trials.")] = 5000,
    seed: options.Seed = 0,
    json_file: options.JsonFile = None,
) -> None:
    """Draw trials from the model itself, and test that an engine's posteriors are those of the model.

    Example: atg-fg engines check --engine bayes-filter --trials 500
    """
    engine_for(engine)
    plan = replace(calibration.PLAN, n_trials=trials)
    with options.progress_bar("trials", trials) as advance:
        summary = calibration.summarise(calibration.run_calibration(engine, plan, seed, advance))
    parameters = {"engine": engine, "trials": trials, "seed": seed}
    document = {"command": "calibrate", "parameters": parameters, **summary}
    if options.write_json(document, json_file):
        test = summary["chi_square"]
        options.print_tables(tables_of(document), f"{engine}: {trials} trials drawn from the model, seed {seed}")
        say(f"reliability error: {summary['reliability_error']:.4f}")
        say(
            f"averaged posterior = prior: chi-square {test['statistic']:.2f}, {test['degrees_of_freedom']} degrees of "
            f"freedom, p = {test['p']:.3f}"
        )
