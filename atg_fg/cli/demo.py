"""``atg-fg demo`` and ``watch``: one recognition trial on the robot, told step by step, filmed or in a viewer."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import typer

from atg_fg.cli import options
from atg_fg.cli.story import Story
from atg_fg.cli.terminal import say
from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.records import TrialRecord
from atg_fg.display import figures, trial_plots
from atg_fg.display.frames import FrameFolder, has_camera
from atg_fg.display.rerun_viewer import TrialViewer, check_path, import_rerun
from atg_fg.engines import begin_trial
from atg_fg.experiments.exploration import explore, learned_memory
from atg_fg.experiments.trial import learn_from, run_trial
from atg_fg.learning.structured_memory import memory_for
from atg_fg.policies import EntropyPolicy, RandomPolicy, make_policy
from atg_fg.storage import memory_files, plain_files
from atg_fg.storage.trial_log import to_json_lines
from atg_fg.worlds.arcube import Cube, make_arcubes
from atg_fg.worlds.base import World
from atg_fg.worlds.registry import assumptions_of, check_arcube_world, make_world, sense_of

N_REMEMBERED: Final = 6
#: Boxes without tags, before the robot and before a rendered camera, where the robot learns what it remembers.
PICTURE_BOXES, RENDERED_BOXES = "robonaut-picture-box", "picture-box"
_ACTIONS: Final = 12


def told_world(world: str) -> str:
    """Return the name of the world that is told of where a user names ``world``: boxes are turned by the robot.

    Raises:
        InvalidInputError: It is neither of ARcubes nor of boxes.
    """
    if world in (PICTURE_BOXES, RENDERED_BOXES):
        return PICTURE_BOXES
    check_arcube_world("--world", world)
    return world


def world_with_memory(
    world: str, parameters: ModelParameters, seed: int, rng: np.random.Generator, **options: Any
) -> tuple[World, RobotMemory]:
    """Return a world of seven objects, and the memory of a robot that turned over the first six, one after the other.

    Args:
        world: Name, as ``told_world`` returns it.
        parameters: Say whether the memory learns what objects share.
        seed: Of the objects.
        rng: Of the trials in which they were learned.
        options: Of the world.
    """
    n_objects = N_REMEMBERED + 1
    if world == PICTURE_BOXES:
        own: dict[str, Any] = {"n_objects": n_objects, "objects_seed": seed}
        made = make_world(world, **own, **options)
        with closing(make_world(RENDERED_BOXES, **own)) as rendered:
            memory = memory_for(parameters, RobotMemory(assumptions_of(rendered, n_objects), sense=sense_of(rendered)))
            explore(memory, rendered, N_REMEMBERED, RandomPolicy(), _ACTIONS, rng)
        return made, memory
    cubes = make_arcubes(n_objects, seed)
    return make_world(world, cubes=cubes, **options), learn_beforehand(cubes, parameters, rng)


def learn_beforehand(cubes: Sequence[Cube], parameters: ModelParameters, rng: np.random.Generator) -> RobotMemory:
    """Return the memory of a robot that turned each of the first six cubes over at random, twelve times.

    It did so in the ideal world, and knew that each was new.
    """
    assumptions, remembered = arcube_assumptions(), cubes[:N_REMEMBERED]
    return learned_memory(assumptions, remembered, RandomPolicy(), _ACTIONS, rng, parameters=parameters)


#: Options of the worlds that have a camera: its last frame is saved, or a film of the trial.
CAMERAS: Final[dict[str, dict[str, Any]]] = {
    "rendered": {"render_mode": "detections", "image_size": (640, 480)},
    "robonaut": {"render_mode": "rgb_array_list"},
    PICTURE_BOXES: {"render_mode": "rgb_array_list"},
}


def demo(
    world: options.DemoWorld = "robonaut",
    engine: options.PresetsEngine = None,
    preset: options.Preset = "default",
    actions: options.Actions = 8,
    novel: Annotated[bool, typer.Option("--novel", help="Present an object the robot has never met.")] = False,
    output: Annotated[Path, options.written(help="Folder for the pictures, the memory and the record.")] = Path("out"),
    condition: options.Condition = None,
    urdf: options.Urdf = None,
    seed: options.Seed = 0,
    json_file: options.JsonFile = None,
) -> None:
    """Let the robot recognise one of the objects it remembers by turning it over, told step by step.

    The memory is learned beforehand, from the same objects turned at random in the ideal world, or before a rendered
    camera if they are boxes without tags. With a camera, the last frame is saved, or a film of the robot.

    Example: atg-fg demo --seed 1 --novel
    """
    world = told_world(world)
    parameters, engine = options.model_of(preset, engine, "gtsam")
    figures.figure_class()  # fails now rather than at the end, if matplotlib is not installed
    folder = plain_files.make_folder(output)
    console = options.console(json_file)
    learn_seed, trial_seed = np.random.SeedSequence(seed).spawn(2)
    world_options = {**CAMERAS.get(world, {}), **options.world_options(condition=condition, urdf=urdf)}
    # The last object is the one the robot never meets while it learns.
    made_world, memory = world_with_memory(world, parameters, seed, np.random.default_rng(learn_seed), **world_options)
    with closing(made_world):
        things = "boxes" if world == PICTURE_BOXES else "cubes"
        console.print(f"The robot remembers {N_REMEMBERED} {things} that it turned over before.")
        rng = np.random.default_rng(trial_seed)
        presented = N_REMEMBERED if novel else int(rng.integers(N_REMEMBERED))
        camera = FrameFolder(folder / "trial.jsonl", made_world) if has_camera(made_world) else None
        story = Story(console, memory) if camera is None else Story(console, memory, camera.take)
        inference, shown = begin_trial(engine, memory, parameters), {"object": presented}
        record = run_trial(
            made_world, inference, EntropyPolicy(), actions, rng, reset_options=shown, on_step=story.tell
        )
        story.verdict(record)
        truth = None if novel else record.names[presented]
        console.print(f"truth:   {truth or 'a new object'}")
        header = {"engine": engine, "preset": preset, "world": world, "seed": seed}
        lines = to_json_lines(record, camera.taken if camera is not None else (), **header)
        _save(folder, made_world, record, memory, lines)
    saved = [str(path) for path in sorted(folder.iterdir())]
    console.print(f"saved:   {', '.join(saved)}")
    ending = {"outcome": record.verdict, "judged_novel": record.judged_novel, "matched": record.matched}
    options.write_json({"command": "demo", **ending, "truth": truth, "saved": saved}, json_file)


def _save(folder: Path, world: World, record: TrialRecord, memory: RobotMemory, lines: str) -> None:
    """Save the film or the last camera frame, the plots, the record, and the memory with what the trial taught."""
    picture: Any = world.render() if world.render_mode else None
    if isinstance(picture, list):
        figures.save_film(picture, world.metadata["render_fps"], folder / "film.gif")
    elif picture is not None:
        figures.save_image(picture, folder / "frame.png")
    figures.save_figure(trial_plots.plot_belief(record), folder / "belief.png")
    figures.save_figure(trial_plots.plot_entropy(record), folder / "entropy.png")
    plain_files.write_bytes_atomically(folder / "trial.jsonl", lines.encode())
    learn_from(record, memory)
    memory_files.save_memory(memory, folder / "memory.json")


def watch(
    world: options.DemoWorld = "robonaut",
    engine: options.PresetsEngine = None,
    preset: options.Preset = "default",
    policy: options.Policy = "entropy",
    actions: options.Actions = 8,
    novel: Annotated[bool, typer.Option("--novel", help="Present an object the robot has never met.")] = False,
    save: Annotated[
        Path | None, options.written(help="Save a recording (.rrd) instead of opening the viewer; needs no screen.")
    ] = None,
    condition: options.Condition = None,
    urdf: options.Urdf = None,
    seed: options.Seed = 0,
) -> None:
    """Watch the robot recognise one of six objects it remembers: the scene in 3D, belief and entropy.

    The memory is learned beforehand, from the same objects turned at random in the ideal world, or before a rendered
    camera if they are boxes without tags.

    Example: atg-fg watch --world robonaut --save trial.rrd
    """
    world = told_world(world)
    import_rerun()  # fails now rather than after the memory is learned, if it is not installed
    if save is not None:
        check_path(save)
    parameters, engine = options.model_of(preset, engine, "bayes-filter")
    chosen_policy = make_policy(policy)
    learn_seed, trial_seed = np.random.SeedSequence(seed).spawn(2)
    own = options.world_options(condition=condition, urdf=urdf)
    made_world, memory = world_with_memory(world, parameters, seed, np.random.default_rng(learn_seed), **own)
    with closing(made_world):
        viewer = TrialViewer(made_world, memory, save)
        story = Story(options.console(), memory, viewer.tell)
        rng = np.random.default_rng(trial_seed)
        presented = N_REMEMBERED if novel else int(rng.integers(N_REMEMBERED))
        inference, shown = begin_trial(engine, memory, parameters), {"object": presented}
        record = run_trial(made_world, inference, chosen_policy, actions, rng, reset_options=shown, on_step=story.tell)
        story.verdict(record)
        viewer.verdict(record)
        viewer.close()
    if save is not None:
        say(f"saved: {save}")
