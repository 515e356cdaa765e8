"""``atg-fg goal``: objects before the robot are recognised and driven to goal aspects (the paper's Figure 2)."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from atg_fg.cli import options
from atg_fg.core.checks import MANY
from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.display import figures
from atg_fg.experiments.document_tables import tables_of
from atg_fg.experiments.goal_scores import summarise
from atg_fg.experiments.goals import COMPLETE, GoalPlan, run_goals, run_many, run_seed
from atg_fg.policies import POLICIES
from atg_fg.policies.goal import ENTROPY_THRESHOLD, PLANNERS
from atg_fg.worlds.base import World

#: Panels of the help page beside those in ``options``.
_MEMORY: Final = "The memory, learned beforehand"
_GOAL: Final = "Reaching the goal"
#: How worlds with a camera are filmed: by an observer, or by what is detected at each look.
RENDER_MODES: Final = {"rendered": "detections", "robonaut": "rgb_array_list"}


def goal(
    world: options.ARcubeWorld = "ideal",
    engine: options.PresetsEngine = None,
    preset: options.Preset = "default",
    cubes: Annotated[
        int, typer.Option(min=1, help="Cubes before the robot, each at a station.", rich_help_panel=options.WORLD)
    ] = 3,
    memory_cubes: Annotated[
        int,
        typer.Option(min=1, help="Cubes that the memory is learned from, these among them.", rich_help_panel=_MEMORY),
    ] = 20,
    learning_actions: Annotated[
        int,
        typer.Option(
            help=f"Actions on each cube while the memory is learned; {COMPLETE} makes it complete.",
            rich_help_panel=_MEMORY,
        ),
    ] = 20,
    learning_policy: Annotated[
        str, typer.Option(help=f"Policy then: {', '.join(POLICIES)}.", rich_help_panel=_MEMORY)
    ] = "explore",
    learning_world: Annotated[
        str, typer.Option(help="World in which the memory is learned.", rich_help_panel=_MEMORY)
    ] = "ideal",
    planner: Annotated[
        str, typer.Option(help=f"How a way is found: {', '.join(PLANNERS)}.", rich_help_panel=_GOAL)
    ] = "attempts",
    unreachable: Annotated[
        str,
        typer.Option(
            help="A goal that no known path leads to: declare (say so and stop) or explore.", rich_help_panel=_GOAL
        ),
    ] = "declare",
    settled: Annotated[
        float, typer.Option(help="Entropy of identity below which a cube is recognised, nats.", rich_help_panel=_GOAL)
    ] = ENTROPY_THRESHOLD,
    trials: Annotated[
        int,
        typer.Option(
            min=1,
            max=MANY,
            help="Runs, each with a memory, cubes and goals of its own.",
            rich_help_panel=options.TRIALS,
        ),
    ] = 20,
    actions: Annotated[int, typer.Option(help="Actions on each cube, at most.", rich_help_panel=options.TRIALS)] = 40,
    seed: Annotated[int, typer.Option(min=0, help="Seed of all runs.", rich_help_panel=options.TRIALS)] = 0,
    slip: options.Slip = 0.0,
    wrong: options.Wrong = 0.0,
    missing: options.Missing = 0.0,
    condition: options.Condition = None,
    urdf: options.Urdf = None,
    jobs: options.Jobs = None,
    executor: options.Executor = "process",
    records: Annotated[
        Path | None,
        typer.Option(
            writable=True, help="Folder in which every run is saved as it ends.", rich_help_panel=options.RUNNING
        ),
    ] = None,
    resume: Annotated[
        bool, typer.Option("--resume", help="Leave out the runs that --records holds.", rich_help_panel=options.RUNNING)
    ] = False,
    video: Annotated[
        Path | None,
        typer.Option(
            writable=True,
            help="Film the first run into this .gif: a world with a camera.",
            rich_help_panel=options.RUNNING,
        ),
    ] = None,
    json_file: options.JsonFile = None,
) -> None:
    """Recognise the cubes before the robot, and turn each until it shows its goal.

    Example: atg-fg goal --cubes 3 --memory-cubes 20 --trials 50 --engine bayes-filter
    """
    workers = options.check_executor_option(executor, jobs)
    if resume and records is None:
        raise InvalidInputError("--resume: no records to go on from; expected --records with their folder")
    if video is not None:
        if world not in RENDER_MODES:
            raise unknown_name("--video: world with a camera", world, RENDER_MODES)
        figures.check_film_path(video)
    model, engine = options.model_of(preset, engine, "gtsam")
    world_options = options.world_options(slip, wrong, missing, condition, urdf)
    plan = GoalPlan(
        world=world,
        world_options=world_options,
        engine=engine,
        parameters=model,
        planner=planner,
        unreachable=unreachable,
        settled=settled,
        n_stations=cubes,
        n_remembered=memory_cubes,
        learning_world=learning_world,
        learning_policy=learning_policy,
        learning_actions=learning_actions,
        n_actions=actions,
    )
    if video is not None:
        _film(plan, seed, video)
    with options.progress_bar("runs", trials) as advance:
        runs = run_many(plan, seed, trials, workers, records, resume, executor, advance)
    summary = summarise(runs)
    parameters: dict[str, Any] = {"world": world, "engine": engine, "preset": preset, "cubes": cubes}
    parameters |= {"memory_cubes": memory_cubes, "learning_actions": learning_actions}
    parameters |= {"learning_policy": learning_policy, "learning_world": learning_world}
    parameters |= {"planner": planner, "unreachable": unreachable, "settled": settled}
    parameters |= {"trials": trials, "actions": actions, "seed": seed, **world_options}
    document = {"command": "goal", "parameters": parameters, **summary}
    if options.write_json(document, json_file):
        title = f"{trials} runs, {cubes} of {memory_cubes} cubes, {world} world, preset {preset}, engine {engine}"
        options.print_tables(tables_of(document), title)


def _film(plan: GoalPlan, seed: int, path: Path) -> None:
    """Film the first run."""
    pictures: list[Any] = []
    rates: list[int] = []

    def take(world: World) -> None:
        picture: Any = world.render()
        pictures.extend(picture if isinstance(picture, list) else [picture])
        rates.append(int(world.metadata["render_fps"]))

    filmed = replace(plan, world_options={**plan.world_options, "render_mode": RENDER_MODES[plan.world]})
    run_goals(filmed, run_seed(seed, 0), on_look=take)
    figures.save_film(pictures, rates[0], path)
