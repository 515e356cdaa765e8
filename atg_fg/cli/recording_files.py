"""``atg-fg recordings``: recordings of a user's own detector checked, converted and simulated."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from atg_fg.cli import options
from atg_fg.cli.recordings import Actions, Aspects, Exclusive, Labels, Objects, Slots, Spec, given_spec
from atg_fg.cli.terminal import say
from atg_fg.core.errors import InvalidInputError
from atg_fg.experiments.simulated_recording import simulated_recording
from atg_fg.storage import plain_files
from atg_fg.storage.bag_process import read_bag
from atg_fg.storage.minari_recordings import read_minari, write_minari
from atg_fg.storage.recordings import check_recording, completed, read_recording, write_recording
from atg_fg.storage.rosbag_recordings import is_bag, read_topics

Output = Annotated[
    Path,
    options.written("--output", "-o", help=".jsonl or .csv to write.", show_default=False),
    plain_files.check_writable,
]
app = typer.Typer(
    help="Check recordings of your own detector, and convert them. Example: atg-fg recordings check looks.csv",
    no_args_is_help=True,
)


@app.command()
def check(
    file: Annotated[Path, options.argument(help="A recording: CSV or JSON lines.")],
    objects: Objects = None,
    slots: Slots = None,
    actions: Actions = None,
    labels: Labels = None,
    spec: Spec = None,
    json_file: options.JsonFile = None,
) -> None:
    """Say what is in a recording, and what is odd: exit status 1 if it cannot be learned from as it is.

    Example: atg-fg recordings check looks.csv --objects 8
    """
    recording, faults = check_recording(file, given_spec(spec, slots, actions, labels, objects, None, None))
    names_of = {
        "slots": list(recording.slots),
        "actions": list(recording.actions),
        "labels": list(recording.labels),
        "readings": list(recording.sense_names),
        "objects": sorted({trial.object for trial in recording.trials if trial.object is not None}),
    }
    document = {
        "command": "recordings check",
        "file": str(file),
        **names_of,
        "trials": len(recording.trials),
        "looks": sum(len(trial.looks) for trial in recording.trials),
        "odd": [{"kind": each.kind, "place": each.place, "what": each.what, "fatal": each.fatal} for each in faults],
    }
    if options.write_json(document, json_file):
        for kind, names in names_of.items():
            if names:
                say(f"{kind}: {', '.join(names)}")
        say(f"{document['trials']} trials, {document['looks']} looks")
        for fault in faults:
            say(f"{'fault' if fault.fatal else 'odd'}, {fault.kind}: {fault}")
        if not faults:
            say("nothing odd")
    if any(fault.fatal for fault in faults):
        raise typer.Exit(1)


@app.command()
def convert(
    file: Annotated[
        Path, options.argument(help="A recording, CSV or JSON lines; a bag of ROS; or the name of a dataset.")
    ],
    output: Output,
    topics: Annotated[
        Path | None, typer.Option(help="JSON file that says in which topics of a bag labels and actions are.")
    ] = None,
    source: Annotated[
        Literal["minari"] | None, typer.Option("--from", help="What FILE is the name of a dataset of.")
    ] = None,
    objects: Objects = None,
    aspects: Aspects = None,
    slots: Slots = None,
    actions: Actions = None,
    labels: Labels = None,
    exclusive: Exclusive = None,
    spec: Spec = None,
) -> None:
    """Write a recording as JSON lines, which also hold what a table does not say, or as CSV.

    A bag of ROS 2 (rosbag2, MCAP) or ROS 1 is read with `--topics`. (Extra `ros`.) A dataset of Minari is read with
    `--from minari`. (Extra `minari`.)

    Example: atg-fg recordings convert looks.csv -o looks.jsonl --objects 8
    """
    given = given_spec(spec, slots, actions, labels, objects, aspects, exclusive)
    if source == "minari":
        recording = completed(read_minari(str(file)), given)
    elif topics is not None:
        recording = completed(read_bag(file, read_topics(topics)), given)
    elif is_bag(file):
        raise InvalidInputError(f"{file}: a bag; expected --topics FILE, which says where labels and actions are")
    else:
        recording = read_recording(file, given)
    write_recording(recording, output)
    say(f"saved: {output}")


@app.command()
def export(
    file: Annotated[Path, options.argument(help="A recording: CSV or JSON lines.")],
    name: Annotated[str, typer.Option(help="Of the new dataset, such as robot/looks-v0.", show_default=False)],
    to: Annotated[Literal["minari"], typer.Option(help="What it is written for.")] = "minari",
    objects: Objects = None,
    aspects: Aspects = None,
    slots: Slots = None,
    actions: Actions = None,
    labels: Labels = None,
    exclusive: Exclusive = None,
    spec: Spec = None,
) -> None:
    """Write a recording as a dataset of Minari, for offline reinforcement learning.

    It goes where Minari keeps its datasets. (Extra `minari`.)

    `recordings convert NAME --from minari` reads it back.

    Example: atg-fg recordings export looks.csv --to minari --name robot/looks-v0
    """
    recording = read_recording(file, given_spec(spec, slots, actions, labels, objects, aspects, exclusive))
    folder, left_out = write_minari(recording, name)
    say(f"saved: {folder}")
    if left_out:
        say(f"left out: {left_out} trials without an action")


@app.command()
def simulate(
    output: Output,
    world: options.World = "detector",
    objects: Annotated[int, typer.Option(min=1, help="|O|, the number of objects that exist.")] = 8,
    trials: Annotated[int, typer.Option(min=1, help="Number of trials.")] = 48,
    actions: options.Actions = 8,
    slip: options.Slip = 0.0,
    wrong: options.Wrong = 0.0,
    missing: options.Missing = 0.0,
    world_option: options.WorldOption = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of objects, trials and actions.")] = 0,
    objects_seed: Annotated[
        int | None, typer.Option(min=0, help="Seed of the recording whose objects these are; --seed if not given.")
    ] = None,
) -> None:
    """Record trials in a world, acted on at random: a recording with the truth in its column `object`.

    Example: atg-fg recordings simulate -o looks.csv --wrong 0.2 --missing 0.1 --world-option confidences=true
    """
    own = options.world_options(slip, wrong, missing, own=world_option)
    for given in {"seed", "objects_seed"} & own.keys():
        raise InvalidInputError(f"--world-option: {given!r}; expected it as --{given.replace('_', '-')}")
    write_recording(simulated_recording(world, objects, trials, actions, seed, objects_seed, **own), output)
    say(f"saved: {output}")
