"""``atg-fg engines``: the inference engines held against each other and against the model."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import typer

from atg_fg.cli import options
from atg_fg.cli.terminal import say
from atg_fg.core.errors import unknown_name
from atg_fg.engines import ENGINES
from atg_fg.experiments import calibration, engine_comparison
from atg_fg.experiments.document_tables import tables_of
from atg_fg.storage.presets import preset as preset_named

app = typer.Typer(
    help="Compare inference engines, and check that one is calibrated. Example: atg-fg engines compare",
    no_args_is_help=True,
)


@app.command()
def compare(
    trials: options.Trials = 50,
    engines: Annotated[str, typer.Option(help=f"all, or a list such as gtsam,particle. {', '.join(ENGINES)}.")] = "all",
    objects: Annotated[int, typer.Option(help="Objects that exist.")] = 100,
    remembered: Annotated[int, typer.Option(help="Objects in the memory.")] = 20,
    actions: options.Actions = 6,
    preset: options.Preset = "default",
    slip: options.Slip = 0.0,
    wrong: options.Wrong = 0.0,
    missing: options.Missing = 0.0,
    seed: options.Seed = 0,
    json_file: options.JsonFile = None,
) -> None:
    """Compare inference engines on the same trials: error against exact, decisions, and cost.

    Example: atg-fg engines compare --trials 10 --engines bayes-filter,gtsam,mean-field
    """
    options.check_json_option(json_file)
    names = list(ENGINES) if engines == "all" else engines.split(",")
    for name in names:
        if name not in ENGINES:
            raise unknown_name("engine", name, ["all", *ENGINES])
    plan = engine_comparison.ComparisonPlan(
        n_trials=trials,
        n_actions=actions,
        n_objects=objects,
        n_remembered=remembered,
        parameters=preset_named(preset),
        world_options=options.world_options(slip, wrong, missing),
    )
    with options.progress_bar("trials", trials) as advance:
        summary = engine_comparison.summarise(engine_comparison.compare(plan, names, seed, advance))
    parameters = {"trials": trials, "objects": objects, "remembered": remembered, "actions": actions, "preset": preset}
    parameters |= {"slip": slip, "wrong": wrong, "missing": missing, "seed": seed}
    document = {"command": "compare", "parameters": parameters, "engines": summary}
    options.write_json(document, json_file)
    if json_file != "-":
        title = f"{trials} trials of {actions} actions, {remembered} of {objects} objects remembered, preset {preset}"
        options.print_tables(tables_of(document), title)


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
    options.check_json_option(json_file)
    if engine not in ENGINES:
        raise unknown_name("engine", engine, ENGINES)
    plan = replace(calibration.PLAN, n_trials=trials)
    with options.progress_bar("trials", trials) as advance:
        summary = calibration.summarise(calibration.run_calibration(engine, plan, seed, advance))
    parameters = {"engine": engine, "trials": trials, "seed": seed}
    document = {"command": "calibrate", "parameters": parameters, **summary}
    options.write_json(document, json_file)
    if json_file != "-":
        test = summary["chi_square"]
        options.print_tables(tables_of(document), f"{engine}: {trials} trials drawn from the model, seed {seed}")
        say(f"reliability error: {summary['reliability_error']:.4f}")
        say(
            f"averaged posterior = prior: chi-square {test['statistic']:.2f}, {test['degrees_of_freedom']} degrees of "
            f"freedom, p = {test['p']:.3f}"
        )
