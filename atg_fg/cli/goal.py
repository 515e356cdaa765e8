"""``atg-fg goal``: objects before the robot are recognised and driven to goal aspects (the paper's Figure 2)."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
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

#: Options in panels of the help page beside those in ``options``.
_in_memory: Final = partial(typer.Option, rich_help_panel="The memory, learned beforehand")
_in_goal: Final = partial(typer.Option, rich_help_panel="Reaching the goal")
#: How worlds with a camera are filmed: by an observer, or by what is detected at each look.
RENDER_MODES: Final = {"rendered": "detections", "robonaut": "rgb_array_list"}


def goal(
    world: options.ARcubeWorld = "ideal",
    engine: options.PresetsEngine = None,
    preset: options.Preset = "default",
    cubes: Annotated[int, options.in_world(min=1, help="Cubes before the robot, each at a station.")] = 3,
    memory_cubes: Annotated[
        int, _in_memory(min=1, help="Cubes that the memory is learned from, these among them.")
    ] = 20,
    learning_actions: Annotated[
        int, _in_memory(help=f"Actions on each cube while the memory is learned; {COMPLETE} makes it complete.")
    ] = 20,
    learning_policy: Annotated[str, _in_memory(help=f"Policy then: {', '.join(POLICIES)}.")] = "explore",
    learning_world: Annotated[str, _in_memory(help="World in which the memory is learned.")] = "ideal",
    planner: Annotated[str, _in_goal(help=f"How a way is found: {', '.join(PLANNERS)}.")] = "attempts",
    unreachable: Annotated[
        str, _in_goal(help="A goal that no known path leads to: declare (say so and stop) or explore.")
    ] = "declare",
    settled: Annotated[
        float, _in_goal(help="Entropy of identity below which a cube is recognised, nats.")
    ] = ENTROPY_THRESHOLD,
    trials: Annotated[
        int, options.in_trials(min=1, max=MANY, help="Runs, each with a memory, cubes and goals of its own.")
    ] = 20,
    actions: Annotated[int, options.in_trials(help="Actions on each cube, at most.")] = 40,
    seed: Annotated[int, options.in_trials(min=0, help="Seed of all runs.")] = 0,
    slip: options.Slip = 0.0,
    wrong: options.Wrong = 0.0,
    missing: options.Missing = 0.0,
    condition: options.Condition = None,
    urdf: options.Urdf = None,
    jobs: options.Jobs = None,
    executor: options.Executor = "process",
    records: Annotated[
        Path | None, options.in_running(writable=True, help="Folder in which every run is saved as it ends.")
    ] = None,
    resume: Annotated[bool, options.in_running("--resume", help="Leave out the runs that --records holds.")] = False,
    video: Annotated[
        Path | None, options.in_running(writable=True, help="Film the first run into this .gif: a world with a camera.")
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
    parameters = {
        "world": world,
        "engine": engine,
        "preset": preset,
        "cubes": cubes,
        "memory_cubes": memory_cubes,
        "learning_actions": learning_actions,
        "learning_policy": learning_policy,
        "learning_world": learning_world,
        "planner": planner,
        "unreachable": unreachable,
        "settled": settled,
        "trials": trials,
        "actions": actions,
        "seed": seed,
        **world_options,
    }
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
