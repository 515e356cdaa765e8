"""``atg-fg watch``: one recognition trial in the Rerun viewer, or as a recording for it."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from atg_fg.cli import options
from atg_fg.cli.beforehand import N_REMEMBERED, told_world, world_with_memory
from atg_fg.cli.story import Story
from atg_fg.cli.terminal import say
from atg_fg.core.records import TrialStep
from atg_fg.display.rerun_viewer import TrialViewer, check_path, import_rerun
from atg_fg.engines import begin_trial
from atg_fg.experiments.trial import run_trial
from atg_fg.policies import make_policy


def watch(
    world: options.DemoWorld = "robonaut",
    engine: options.PresetsEngine = None,
    preset: options.Preset = "default",
    policy: options.Policy = "entropy",
    actions: options.Actions = 8,
    novel: Annotated[bool, typer.Option("--novel", help="Present an object the robot has never met.")] = False,
    save: Annotated[
        Path | None,
        typer.Option(writable=True, help="Save a recording (.rrd) instead of opening the viewer; needs no screen."),
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
    made_world, memory = world_with_memory(
        world,
        parameters,
        seed,
        np.random.default_rng(learn_seed),
        **options.world_options(condition=condition, urdf=urdf),
    )
    with closing(made_world):
        viewer = TrialViewer(made_world, memory, save)
        story = Story(options.console(), memory)
        rng = np.random.default_rng(trial_seed)
        presented = N_REMEMBERED if novel else int(rng.integers(N_REMEMBERED))

        def on_step(step: TrialStep) -> None:
            story.tell(step)
            viewer.tell(step)

        inference = begin_trial(engine, memory, parameters)
        record = run_trial(
            made_world, inference, chosen_policy, actions, rng, reset_options={"object": presented}, on_step=on_step
        )
        story.verdict(record)
        viewer.verdict(record)
        viewer.close()
    if save is not None:
        say(f"saved: {save}")
