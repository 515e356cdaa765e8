"""``atg-fg sim``: how reliable the robot is, the noise that recognition should assume, and pictures of it at work.

The command line of ``atg_fg`` finds this group by its entry point; nothing there imports it.
"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table

from atg_fg.cli import options
from atg_fg.cli.terminal import say
from atg_fg.core.checks import MANY
from atg_fg.display import figures
from atg_fg.storage import plain_files
from atg_fg.storage.presets import write_preset

app = typer.Typer(
    help="The simulated robot: reliability, calibration, pictures. Example: atg-fg sim picture", no_args_is_help=True
)

Condition = Annotated[str, typer.Option(help="What the robot works under: nominal or worn.")]
Pictures = Annotated[bool, typer.Option("--pictures", help="Boxes with pictures in place of cubes with tags.")]
Actions = Annotated[int, typer.Option(min=1, help="Number of random actions.")]


@app.command()
def reliability(
    condition: Condition = "nominal",
    actions: Actions = 1000,
    stations: Annotated[
        int, typer.Option(min=1, help="Cubes in the scene; the robot goes to a random one each time.")
    ] = 1,
    pictures: Pictures = False,
    seed: Annotated[int, typer.Option(min=0, help="Seed of cubes, actions and circumstances.")] = 0,
    urdf: options.Urdf = None,
    jobs: options.Jobs = None,
    json_file: options.JsonFile = None,
) -> None:
    """Let the robot do random actions and count, by the simulator's truth, how often they come out right.

    Example: atg-fg sim reliability --condition worn --actions 200 --json worn.json
    """
    from sim.reliability import ACTIONS_A_TRIAL, run_actions, summarise

    with options.progress_bar("trials", -(-actions // ACTIONS_A_TRIAL)) as advance:
        n_jobs = jobs or options.available_cpus()
        runs = run_actions(condition, actions, seed, n_jobs, urdf, advance, stations, pictures)
    summary = summarise(runs)
    parameters = {"condition": condition, "actions": actions, "seed": seed}
    if stations > 1:
        parameters["stations"] = stations
    if pictures:
        parameters["pictures"] = True
    if urdf is not None:
        parameters["urdf"] = str(urdf)
    if options.write_json({"command": "sim reliability", "parameters": parameters, **summary}, json_file):
        options.console().print(_reliability_table(f"{condition}: {actions} random actions, seed {seed}", summary))


@app.command()
def calibrate(
    files: Annotated[list[Path], typer.Argument(help="What sim reliability --json wrote.", show_default=False)],
    output: Annotated[
        Path,
        typer.Option(writable=True, help="Preset file to write; --preset takes it."),
        plain_files.check_writable,
    ] = Path("robot.json"),
    json_file: options.JsonFile = None,
) -> None:
    """Estimate the noise of actions and looks from reliability runs, and write the preset that assumes as much.

    Example: atg-fg sim calibrate worn.json --output robot.json
    """
    from sim.noise_calibration import calibrate as estimate
    from sim.noise_calibration import read_counts

    counts = read_counts(files)
    parameters, missing_rate = estimate(counts)
    command = f"atg-fg sim calibrate {' '.join(map(str, files))}"
    document = write_preset(parameters, missing_rate=missing_rate, measured=asdict(counts), command=command)
    options.write_json(document, str(output))
    if options.write_json({"command": "sim calibrate", "output": str(output), "preset": document}, json_file):
        for name, value in {**document["parameters"], "missing_rate": missing_rate}.items():
            say(f"{name}: {value}")
        say(f"saved: {output}")


@app.command()
def picture(
    output: Annotated[Path, typer.Option(writable=True, help="PNG file to write.")] = Path("robot.png"),
    film: Annotated[
        Path | None, typer.Option(writable=True, help="Write the robot's three actions as an animated GIF.")
    ] = None,
    table: Annotated[
        Path | None, typer.Option(writable=True, help="Write a picture of the robot before three cubes, PNG.")
    ] = None,
    pictures: Pictures = False,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the cubes.")] = 0,
    urdf: options.Urdf = None,
) -> None:
    """Draw the robot as it turns a cube over: a strip of one flip, and what its head sees.

    Example: atg-fg sim picture --output robot.png --film actions.gif --table table.png
    """
    from sim.pictures import draw_actions, draw_flip, draw_table

    for file in (output, table):
        if file is not None:
            figures.check_figure_path(file)
    figures.save_image(draw_flip(seed, urdf, boxes=pictures), output)
    if film is not None:
        figures.save_film(*draw_actions(seed, urdf, boxes=pictures), film)
    if table is not None:
        figures.save_image(draw_table(seed, urdf), table)
    say(f"saved: {', '.join(str(file) for file in (output, film, table) if file is not None)}")


@app.command()
def webcam(
    tags: Annotated[Path, typer.Option(help="Tags of the cubes, as print cube wrote them (JSON).")],
    output: Annotated[
        Path,
        typer.Option("--output", "-o", writable=True, help="Video to write, .avi or .mp4."),
        plain_files.check_writable,
    ],
    calibration: Annotated[
        Path,
        typer.Option(writable=True, help="File for the calibration of the webcam, which live takes."),
        plain_files.check_writable,
    ] = Path("webcam.json"),
    trials: Annotated[int, typer.Option(min=1, max=MANY, help="Cubes put down, each once before any comes again.")] = 3,
    actions: Annotated[
        int,
        typer.Option(min=0, max=MANY, help="Turns of each, at random, to views not shown before where there are such."),
    ] = 5,
    seed: Annotated[int, typer.Option(min=0, help="Seed of cubes, turns, noise, and how straight cubes stand.")] = 0,
) -> None:
    """Film cubes that are turned by hand before a webcam, to try live where there is no camera.

    Example: atg-fg sim webcam --tags cubes.json -o turns.avi
    """
    from sim.vision.random_film import film_cubes

    for number, (cube, turns) in enumerate(film_cubes(tags, output, calibration, trials, actions, seed)):
        say(f"trial {number}: cube {cube + 1}, turned {', '.join(turns) or 'not at all'}")
    say(f"saved: {output}, {calibration}")


def _reliability_table(title: str, summary: dict[str, Any]) -> Table:
    table = Table(title=title, title_justify="left")
    for heading in ("", "count", "rate", "95% interval"):
        table.add_column(heading, justify="left" if not heading else "right")
    rows = {"right": summary["success"], **{f"  {name}": rate for name, rate in summary["by_action"].items()}}
    rows |= {f"{name.replace('_', ' ')} detected": rate for name, rate in summary.get("detection", {}).items()}
    boxes = summary.get("boxes", {})
    rows |= {"box found": boxes["found"]} if boxes else {}
    for name, rate in rows.items():
        if rate["of"]:
            low, high = rate["interval95"]
            table.add_row(
                name,
                f"{rate['count']}/{rate['of']}",
                f"{100 * rate['rate']:.1f}%",
                f"{100 * low:.1f}-{100 * high:.1f}%",
            )
    table.add_section()
    spreads = {
        "angle error, degrees": (summary["angle_error_degrees"], 1.0),
        "position error, mm": (summary["position_error_metres"], 1000.0),
        "peak force of a hand, N": (summary["peak_force_newtons"], 1.0),
        "simulated seconds an action": (summary["simulated_seconds_per_action"], 1.0),
    }
    if boxes:
        spreads["box found off by, mm"] = (boxes["position_error_metres"], 1000.0)
        spreads["box found turned off by, degrees"] = (boxes["yaw_error_degrees"], 1.0)
        spreads["weighed too heavy, g"] = (boxes["mass_error_kilograms"] or {}, 1000.0)
    for name, (spread, unit) in spreads.items():
        texts = (f"{key} {unit * value:.2f}" for key, value in spread.items() if value is not None)
        table.add_row(name, *texts)
    joints, timing = summary["joints"], summary["timing"]
    table.add_section()
    table.add_row("failures", *(f"{name.replace('_', ' ')} {count}" for name, count in summary["failures"].items()))
    table.add_row(
        "joints, of their limits",
        f"speed {joints['largest_share_of_velocity_limit']:.2f}",
        f"torque {joints['largest_share_of_effort_limit']:.2f}",
        f"self-contacts {joints['self_contacts']}",
    )
    table.add_row(
        "wall clock",
        f"{timing['wall_seconds_per_action']:.2f} s an action",
        f"{timing['steps_per_wall_second']:.0f} steps/s",
    )
    return table
