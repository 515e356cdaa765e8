"""``atg-fg trial`` and ``atg-fg replay``: single trials."""

from __future__ import annotations

import json
import os
import sys
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import typer
from rich.table import Table

from atg_fg.cli import options
from atg_fg.cli.story import Story
from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.records import Experiment, TrialSummary
from atg_fg.core.version import __version__
from atg_fg.display.frames import FrameFolder
from atg_fg.engines import begin_trial
from atg_fg.experiments.replay import replay as replay_script
from atg_fg.experiments.trial import learn_from, run_trial
from atg_fg.learning.structured_memory import memory_for
from atg_fg.policies import make_policy
from atg_fg.storage import plain_files
from atg_fg.storage.database.connection import is_database
from atg_fg.storage.memory_files import load_memory, open_memory, save_trial
from atg_fg.storage.presets import preset as preset_named
from atg_fg.storage.scripted_trial import read_script
from atg_fg.storage.trial_log import to_json_lines
from atg_fg.worlds.registry import assumptions_of, make_world_with, sense_of

#: Objects of the world that ``atg-fg trial`` makes, |O|.
N_OBJECTS: Final = 100


def trial(
    world: options.World = "ideal",
    engine: options.PresetsEngine = None,
    preset: options.Preset = "default",
    policy: options.Policy = "entropy",
    actions: options.Actions = 10,
    settled: options.Settled = None,
    memory: Annotated[
        Path | None, typer.Option(help="Memory file (JSON, .db or .npz) to start from; empty if not given.")
    ] = None,
    save_memory: Annotated[
        Path | None,
        options.written(help="Save the memory with what was learned to this file."),
        plain_files.check_writable,
    ] = None,
    record: Annotated[
        Path | None,
        options.written(help="Write the trial's record as JSON lines to this file."),
        plain_files.check_writable,
    ] = None,
    frames: Annotated[
        bool, typer.Option("--frames", help="Save what the camera sees at each look in a folder beside the record.")
    ] = False,
    seed: options.Seed = 0,
    cubes_seed: Annotated[int, typer.Option(min=0, help="Seed of the world's 100 objects, cubes or others.")] = 0,
    slip: options.Slip = 0.0,
    wrong: options.Wrong = 0.0,
    missing: options.Missing = 0.0,
    condition: options.Condition = None,
    urdf: options.Urdf = None,
    json_file: options.JsonFile = None,
) -> None:
    """Run one recognition trial, tell it step by step, and learn from it.

    A database that is saved to itself learns in place: the trial, its record and what is learned are one transaction.

    Example: atg-fg trial --memory robot.db --save-memory robot.db --seed 3
    """
    if frames and record is None:
        raise InvalidInputError("--frames: no record to keep them with; expected --record FILE")
    chosen_policy = make_policy(policy, settled)
    parameters, engine = options.model_of(preset, engine, "gtsam")
    world_options = options.world_options(slip, wrong, missing, condition, urdf)
    header: dict[str, Any] = {"engine": engine, "policy": policy, "preset": preset, "world": world, "seed": seed}
    if settled is not None:
        header["settled"] = settled
    with ExitStack() as stack:
        kept = _opened(memory, save_memory)
        if kept is not None:
            stack.callback(kept.close)
        made_world = stack.enter_context(closing(make_world_with(world, N_OBJECTS, cubes_seed, **world_options)))
        empty = RobotMemory(assumptions_of(made_world, N_OBJECTS), sense=sense_of(made_world))
        remembered = stack.enter_context(memory_for(parameters, empty if kept is None else kept))
        inference = begin_trial(engine, remembered, parameters)
        console = options.console(json_file)
        rng = np.random.default_rng(np.random.SeedSequence(seed))
        camera = FrameFolder(record, made_world) if frames and record is not None else None
        story = Story(console, remembered) if camera is None else Story(console, remembered, camera.take)
        result = run_trial(made_world, inference, chosen_policy, actions, rng, on_step=story.tell)
        story.verdict(result)
        story.mistakes(result.mistakes)
        lines = to_json_lines(result, camera.taken if camera is not None else (), **header)
        if record is not None:
            plain_files.write_bytes_atomically(record, lines.encode())
        about = {**header, "actions": actions, "cubes_seed": cubes_seed, "world_options": world_options}
        del about["seed"]
        remembered.begin_experiment("trial", about, seed)
        learned = learn_from(result, remembered)
        if save_memory is not None:
            experiment = Experiment("trial", about, seed, __version__)
            save_trial(remembered, save_memory, TrialSummary.of(result, learned), experiment)
    steps = [json.loads(line) for line in lines.splitlines()[1:-1]]
    ending = {"outcome": result.verdict, "judged_novel": result.judged_novel, "matched": result.matched}
    document = {"command": "trial", "parameters": header, "steps": steps, **ending, "learned": learned}
    options.write_json(document, json_file)


def _opened(memory: Path | None, save_memory: Path | None) -> RobotMemory | None:
    """Return the memory to start from; it keeps what it learns if it is saved to the database that it comes from."""
    if memory is None:
        return None
    if save_memory is not None and is_database(memory) and os.path.exists(save_memory) and memory.samefile(save_memory):
        return open_memory(memory)
    return load_memory(memory)


def replay(
    files: Annotated[list[Path], options.argument(help="Scripted trials (JSON).")],
    engine: options.Engine = "gtsam",
    smooth: Annotated[bool, typer.Option("--smooth", help="Add p(X_t | all evidence) of every look.")] = False,
    table: Annotated[bool, typer.Option("--table", help="Print a table for people instead of JSON.")] = False,
) -> None:
    """Replay scripted trials: print the posteriors at every step, a JSON document a line for each file.

    Example: atg-fg replay trial.json --engine bayes-filter --smooth
    """
    begin_trial(engine, RobotMemory(arcube_assumptions()), preset_named("default"))
    scripts = [read_script(plain_files.read_text_file(file), str(file)) for file in files]
    # All are run before any is printed: a step of probability zero in one of them must not leave half an answer.
    documents = [replay_script(script, engine, smooth=smooth) for script in scripts]
    for file, document in zip(files, documents, strict=True):
        if table:
            options.console().print(_replay_table(str(file), document))
        else:
            sys.stdout.write(json.dumps(document, allow_nan=False) + "\n")


def _replay_table(title: str, document: dict[str, Any]) -> Table:
    """Return the steps with the three most probable objects, entropies and best actions."""
    table = Table(title=f"{title} ({document['engine']})", title_justify="left")
    for heading in ("step", "kind", "most probable objects", "unseen", "entropy", "best actions", "log evidence"):
        table.add_column(heading)
    for step in document["steps"]:
        best = sorted(step["objects"].items(), key=lambda item: -item[1])[:3]
        table.add_row(
            str(step["step"]),
            step["kind"],
            ", ".join(f"{name} {probability:.3f}" for name, probability in best),
            f"{step['unseen']:.3f}",
            f"{step['entropy']:.3f}",
            ", ".join(step.get("best_actions", [])),
            f"{step['log_evidence']:.3f}",
        )
    return table
