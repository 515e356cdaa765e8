"""``atg-fg learn`` and ``recognise``: what a user's own detector saw, in CSV or JSON lines."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import closing
from pathlib import Path
from typing import Annotated, Any

import typer

from atg_fg.cli import options
from atg_fg.cli.terminal import say
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.checks import brief
from atg_fg.core.errors import InvalidInputError, MissingDependencyError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.plugins import loaded, registered
from atg_fg.core.recordings import Recording, assumptions_for
from atg_fg.core.table import Table
from atg_fg.experiments import recorded_trials
from atg_fg.experiments.scores import Score
from atg_fg.learning.predictive_checks import summary_of_evidence, too_many_graphs
from atg_fg.learning.structured_memory import StructuredMemory, memory_for
from atg_fg.storage import plain_files
from atg_fg.storage.memory_files import check_holds, goes_to_database, has_memory, load_memory, open_memory, save_memory
from atg_fg.storage.recording_oddities import oddities
from atg_fg.storage.recordings import RecordingSpec, merged_spec, read_recording, read_spec

RecordingFiles = Annotated[list[Path], options.argument(help="Recordings: CSV or JSON lines, gzipped or not.")]
Spec = Annotated[Path | None, typer.Option(help="JSON file that says what the recordings do not.")]
Slots = Annotated[str | None, typer.Option(help="Columns that are slots, such as front,top.")]
Actions = Annotated[str | None, typer.Option(help="All actions that there are, such as rotate,tip.")]
Labels = Annotated[str | None, typer.Option(help="All labels that there are; another one is then refused.")]
Objects = Annotated[int | None, typer.Option(min=1, help="|O|, the number of objects that exist.")]
Aspects = Annotated[
    int | None, typer.Option(min=1, help="|G|, aspects of an object; as many as patterns, up to 24, if not given.")
]
Exclusive = Annotated[
    bool | None, typer.Option("--exclusive/--no-exclusive", help="Whether a label is in one slot only, as a tag is.")
]
MemoryPath = Annotated[
    Path, options.written(help="The memory; a new one is begun if there is none.", show_default=False)
]


def learn(
    files: RecordingFiles,
    memory: MemoryPath,
    teach: Annotated[
        bool, typer.Option("--teach", help="Take each trial for one of the object in its column `object`.")
    ] = False,
    name: Annotated[str | None, typer.Option(help="Teach all trials as this object.")] = None,
    objects: Objects = None,
    aspects: Aspects = None,
    slots: Slots = None,
    actions: Actions = None,
    labels: Labels = None,
    exclusive: Exclusive = None,
    spec: Spec = None,
    preset: options.Preset = "learned",
    engine: options.PresetsEngine = None,
    json_file: options.JsonFile = None,
) -> None:
    """Learn from recordings, trial by trial: which are of one object, how objects move, how the detector errs.

    Example: atg-fg learn looks.csv --memory robot.db --objects 8
    """
    parameters, chosen = options.model_of(preset, engine, "bayes-filter")
    given = given_spec(spec, slots, actions, labels, objects, aspects, exclusive)
    recordings = [read_recording(file, given) for file in files]
    if name is not None:
        recordings = [each.taught_as(name) for each in recordings]
    teaches = teach or name is not None
    with closing(_memory_for(memory, recordings, parameters, teaches=teaches)) as kept:
        with options.progress_bar("trials", sum(len(each.trials) for each in recordings)) as advance:
            for each in recordings:
                if teaches:
                    recorded_trials.teach(each, kept, advance)
                else:
                    recorded_trials.learn(each, kept, chosen, parameters, advance)
        document = {"command": "learn", **_learned(kept, memory, recordings)}
        is_told = _save(kept, memory, document, json_file)
    if is_told:
        _tell_learned(document)


def recognise(
    files: RecordingFiles,
    memory: MemoryPath,
    learns: Annotated[
        bool, typer.Option("--learn", help="Learn from each trial before the next; a new memory is begun if need be.")
    ] = False,
    objects: Objects = None,
    aspects: Aspects = None,
    slots: Slots = None,
    actions: Actions = None,
    labels: Labels = None,
    exclusive: Exclusive = None,
    spec: Spec = None,
    preset: options.Preset = "learned",
    engine: options.PresetsEngine = None,
    report: Annotated[Path | None, options.written(help="HTML page of the trials to write.")] = None,
    json_file: options.JsonFile = None,
) -> None:
    """Recognise the object of each trial in recordings, with the posterior after every look.

    Example: atg-fg recognise new.csv --memory robot.db --report page.html
    """
    write_page = None
    if report is not None:
        plain_files.check_writable(report)
        write_page = _page_writer()
    parameters, chosen = options.model_of(preset, engine, "bayes-filter")
    given = given_spec(spec, slots, actions, labels, objects, aspects, exclusive)
    recordings = [read_recording(file, given) for file in files]
    if not learns and not os.path.exists(memory):
        raise InvalidInputError(f"{memory}: no such file; expected a memory, or --learn to begin one")
    with closing(_memory_for(memory, recordings, parameters, keeps=learns)) as kept:
        presented = {trial.object for each in recordings for trial in each.trials}
        made_from: dict[str, object] = {name: name for name in kept.names if name in presented}
        scores = Score(made_from) if learns and None not in presented else None
        found: list[recorded_trials.Recognised] = []
        with options.progress_bar("trials", sum(len(each.trials) for each in recordings)) as advance:
            for each in recordings:
                found += recorded_trials.recognise(
                    each, kept, chosen, parameters, learn=learns, scores=scores, on_trial=advance
                )
        if not learns and presented != {None}:
            made_from = recorded_trials.names_by_majority(found, made_from)
            scores, found = recorded_trials.scored_afterwards(found, made_from)
        scored = None if scores is None else recorded_trials.score_document(scores)
        document = {
            "command": "recognise",
            "trials": [recorded_trials.trial_document(each) for each in found],
            "score": scored,
            "warnings": [*_warnings(kept, _evidence_of(kept), recordings), *recorded_trials.improbable_trials(found)],
        }
        if write_page is not None and report is not None:
            write_page(found, kept, scored, report)
        is_told = _save(kept, memory if learns else None, document, json_file)
    if is_told:
        options.print_tables([_table_of(document)])
        _tell_score(document)
        if report is not None:
            say(f"saved: {report}")


def _save(memory: RobotMemory, path: Path | None, document: dict[str, Any], json_file: str | None) -> bool:
    """Write what a command found, then the memory: whoever repeats one that failed does not learn all once more.

    Returns as ``options.write_json`` does.
    """
    is_told = options.write_json(document, json_file)
    if path is not None and not memory.is_kept:
        save_memory(memory, path)
    return is_told


def given_spec(
    spec: Path | None,
    slots: str | None,
    actions: str | None,
    labels: str | None,
    objects: int | None,
    aspects: int | None,
    exclusive: bool | None,
) -> RecordingSpec:
    """Return what options say, and else what the spec file does."""
    said = RecordingSpec(
        _listed(slots, "slots"), _listed(actions, "actions"), _listed(labels, "labels"), objects, aspects, exclusive
    )
    return said if spec is None else merged_spec(said, read_spec(spec))


def _listed(text: str | None, option: str) -> tuple[str, ...] | None:
    if text is None:
        return None
    names = tuple(name.strip() for name in text.split(","))
    if not all(names) or len(set(names)) < len(names):
        raise InvalidInputError(f"--{option}: {brief(text)}; expected names, all different, with commas between them")
    return names


def _memory_for(
    path: Path,
    recordings: Sequence[Recording],
    parameters: ModelParameters,
    *,
    keeps: bool = True,
    teaches: bool = False,
) -> RobotMemory:
    """Return the memory in a file, or a new one, that knows the labels of all recordings.

    Args:
        path: The file.
        recordings: What it is to take.
        parameters: Of the model.
        keeps: Whether what it learns goes to the file.
        teaches: Whether the recordings have to name an object for each trial.

    Raises:
        InvalidInputError: It cannot take all of them; then nothing is learned from any, nor is a file begun.
    """
    if keeps:
        plain_files.check_writable(path)
    if not keeps or (has_memory(path) and not goes_to_database(path)):
        held = load_memory(path)
    elif has_memory(path):
        held = open_memory(path)
    else:
        assumptions = _extended(recordings[0].assumptions(), recordings, teaches)
        held = open_memory(path, assumptions) if goes_to_database(path) else RobotMemory(assumptions)
    try:
        held.extend(_extended(held.assumptions, recordings, teaches).alphabet.names)
        memory = memory_for(parameters, held)
        if keeps and not held.is_kept:
            check_holds(memory, path)
    except InvalidInputError:
        held.close()
        raise
    return memory


def _extended(assumptions: Assumptions, recordings: Sequence[Recording], teaches: bool) -> Assumptions:
    for each in recordings:
        assumptions = assumptions_for(each, assumptions)
    for each in recordings:
        recorded_trials.check(each, assumptions, taught=teaches)
    return assumptions


def _page_writer() -> Any:
    pages = registered("atg_fg.pages")
    if "recognised" not in pages:
        raise MissingDependencyError("--report: nothing is installed that writes pages; expected atg_fg.report")
    return loaded("page", pages["recognised"])


def _learned(memory: RobotMemory, path: Path, recordings: Sequence[Recording]) -> dict[str, Any]:
    evidence = _evidence_of(memory)
    trials = len(memory.learner.trials) if isinstance(memory, StructuredMemory) else None
    return {
        "memory": str(path),
        "objects": list(memory.names),
        "trials": trials,
        "wrong": evidence.get("wrong"),
        "slip": evidence.get("slip"),
        "warnings": _warnings(memory, evidence, recordings),
    }


def _evidence_of(memory: RobotMemory) -> dict[str, Any]:
    return summary_of_evidence(memory) if isinstance(memory, StructuredMemory) else {}


def _warnings(memory: RobotMemory, evidence: dict[str, Any], recordings: Sequence[Recording]) -> list[str]:
    """Return which assumptions do not seem to hold, by what was learned and what was recorded."""
    n_objects = memory.assumptions.n_objects
    return [
        *(
            f"{each.place}: {each.n_objects} objects; the memory was begun for {n_objects}, which counts"
            for each in recordings
            if each.n_objects not in (None, n_objects)
        ),
        *(evidence.get("warnings") or too_many_graphs(memory)),
        *(
            f"{each.place}: {odd.what}"
            for each in recordings
            for odd in oddities(each)
            if odd.kind in ("one action", "still action")
        ),
    ]


def _tell_learned(document: dict[str, Any]) -> None:
    say(f"{document['memory']}: {len(document['objects'])} objects")
    if document["wrong"] is not None:
        say(f"{document['wrong']:.1%} of labels are wrong, {document['slip']:.1%} of actions slip, by what was learned")
    for warning in document["warnings"]:
        say(f"warning: {warning}")


def _tell_score(document: dict[str, Any]) -> None:
    for name, count in (document["score"] or {}).items():
        low, high = count["interval95"]
        say(f"{name}: {count['count']} of {count['of']} ({100 * low:.1f}–{100 * high:.1f} %)")
    for warning in document["warnings"]:
        say(f"warning: {warning}")


def _table_of(document: dict[str, Any]) -> Table:
    rows = []
    for trial in document["trials"]:
        last = trial["steps"][-1]
        matched = trial["matched"]
        sure = last["unseen"] if matched is None else last["objects"][matched]
        right = {True: "right", False: "wrong", None: "–"}[trial["right"]]
        rows.append((trial["trial"], trial["verdict"], matched or "–", f"{sure:.1%}", trial["object"] or "–", right))
    return Table("Trials", ("trial", "verdict", "matched", "probability", "in truth", ""), tuple(rows))
