"""``atg-fg demo``: one recognition trial on the robot, told step by step, and filmed."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import typer

from atg_fg.cli import options
from atg_fg.cli.beforehand import N_REMEMBERED, PICTURE_BOXES, told_world, world_with_memory
from atg_fg.cli.story import Story
from atg_fg.core.memory import RobotMemory
from atg_fg.core.records import TrialRecord, TrialStep
from atg_fg.display import figures, trial_plots
from atg_fg.display.frames import FrameFolder, has_camera
from atg_fg.engines import begin_trial
from atg_fg.experiments.trial import learn_from, run_trial
from atg_fg.policies import EntropyPolicy
from atg_fg.storage import memory_files, plain_files
from atg_fg.storage.trial_record import to_json_lines
from atg_fg.worlds.base import World

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
    output: Annotated[
        Path, typer.Option(writable=True, help="Folder for the pictures, the memory and the record.")
    ] = Path("out"),
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
        story = Story(console, memory)
        camera = FrameFolder(folder / "trial.jsonl", made_world) if has_camera(made_world) else None

        def on_step(step: TrialStep) -> None:
            story.tell(step)
            if camera is not None:
                camera.take(step)

        record = run_trial(
            made_world,
            begin_trial(engine, memory, parameters),
            EntropyPolicy(),
            actions,
            rng,
            reset_options={"object": presented},
            on_step=on_step,
        )
        story.verdict(record)
        truth = None if novel else record.names[presented]
        console.print(f"truth:   {truth or 'a new object'}")
        header = {"engine": engine, "preset": preset, "world": world, "seed": seed}
        lines = to_json_lines(record, camera.taken if camera is not None else (), **header)
        _save(folder, made_world, record, memory, lines)
    saved = [str(path) for path in sorted(folder.iterdir())]
    console.print(f"saved:   {', '.join(saved)}")
    document = {
        "command": "demo",
        "outcome": record.verdict,
        "judged_novel": record.judged_novel,
        "matched": record.matched,
        "truth": truth,
    }
    options.write_json({**document, "saved": saved}, json_file)


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
