"""``atg-fg engines``: the inference engines held against each other and against the model."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any

import typer
from rich.table import Table

from atg_fg.cli import options
from atg_fg.cli.terminal import say
from atg_fg.core.errors import unknown_name
from atg_fg.engines import ENGINES
from atg_fg.experiments import calibration, engine_comparison
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
    options.write_json({"command": "compare", "parameters": parameters, "engines": summary}, json_file)
    if json_file != "-":
        title = f"{trials} trials of {actions} actions, {remembered} of {objects} objects remembered, preset {preset}"
        options.console().print(_comparison_table(title, summary))


def _comparison_table(title: str, summary: dict[str, Any]) -> Table:
    table = Table(title=title, title_justify="left")
    for heading in ("engine", "exact", "total variation, mean", "worst", "same decision", "time, as a ratio"):
        table.add_column(heading, justify="left" if heading in ("engine", "exact") else "right")
    for name, entry in summary.items():
        if entry["refused"] is not None:
            table.add_row(name, "yes" if entry["exact"] else "no", "-", "-", "-", "too large")
            continue
        distance, same, ratio = entry["total_variation"], entry["same_decision"], entry["time_ratio"]
        low, high = same["interval95"]
        table.add_row(
            name,
            "yes" if entry["exact"] else "no",
            f"{distance['mean']:.2g}",
            f"{distance['worst']:.2g}",
            f"{100 * same['rate']:.1f}% ({100 * low:.1f}-{100 * high:.1f})",
            f"{ratio['median']:.3g} ({ratio['quartiles'][0]:.3g}-{ratio['quartiles'][1]:.3g})",
        )
    return table


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
    options.write_json({"command": "calibrate", "parameters": parameters, **summary}, json_file)
    if json_file != "-":
        test = summary["chi_square"]
        table = Table(title=f"{engine}: {trials} trials drawn from the model, seed {seed}", title_justify="left")
        for heading in ("probability given", "times", "mean", "share that was true"):
            table.add_column(heading, justify="right")
        for each in summary["reliability"]:
            tenth = f"{each['from']:.1f}-{each['from'] + 0.1:.1f}"
            table.add_row(tenth, str(each["count"]), f"{each['predicted']:.3f}", f"{each['found']:.3f}")
        options.console().print(table)
        say(f"reliability error: {summary['reliability_error']:.4f}")
        say(
            f"averaged posterior = prior: chi-square {test['statistic']:.2f}, {test['degrees_of_freedom']} degrees of "
            f"freedom, p = {test['p']:.3f}"
        )
