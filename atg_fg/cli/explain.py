"""``atg-fg explain``: how what was seen in a scripted trial can have come about."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
import typer
from rich.table import Table

from atg_fg.cli import options
from atg_fg.core.errors import InvalidInputError
from atg_fg.engines.learned_structure import KindExplanation, LearnedStructure
from atg_fg.experiments.replay import run_script, smoothed
from atg_fg.inference.explanations import Explanation, best_explanations, sample_explanations, surprise
from atg_fg.inference.interface import Inference
from atg_fg.learning.object_kinds import kinds_of
from atg_fg.storage import memory_files, plain_files
from atg_fg.storage.scripted_trial import ScriptedTrial, read_script

#: Kinds less probable than this are left out.
LEAST_SHOWN: Final = 1e-3


def explain(
    file: Annotated[Path, options.argument(help="A scripted trial (JSON).")],
    k: Annotated[int, typer.Option("--k", min=1, help="How many explanations, the most probable first.")] = 5,
    samples: Annotated[int, typer.Option(min=0, help="How many explanations to draw from the posterior.")] = 0,
    smooth: Annotated[bool, typer.Option("--smooth", help="Add p(X_t | all evidence) of every look.")] = False,
    engine: options.Engine = "gtsam",
    memory: Annotated[
        Path | None,
        typer.Option(
            "--memory", help="Explain it by this robot memory, and by the kinds of objects that it has learned."
        ),
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the samples.")] = 0,
    json_file: options.JsonFile = None,
) -> None:
    """Print the most probable explanations of a trial (object and aspects), and how surprising each look was.

    With --memory it is told what kind of thing the object is: "a thing like these 34: 6 places, 24 poses".

    Example: atg-fg explain tests/data/scripted_trial.json --k 3 --smooth
    """
    if memory is not None and samples:
        raise InvalidInputError("--samples: none are drawn over kinds of objects; expected it without --memory")
    script = read_script(plain_files.read_text_file(file), str(file))
    if memory is not None:
        script, engine = _with_memory(script, memory), "learned-structure"
    evidence = [0.0]

    def take_note(inference: Inference, *, observed: bool) -> None:
        if observed:
            evidence.append(inference.log_evidence)

    inference = run_script(script, engine, take_note)
    document: dict[str, Any] = {"command": "explain", "file": str(file), "log_evidence": inference.log_evidence}
    chain = inference.chain()
    if isinstance(inference, LearnedStructure):
        document["surprise"] = (-np.diff(evidence)).tolist()
        document["explanations"] = [_entry_of_kind(inference, each) for each in inference.kind_explanations(k)]
        document["kinds"] = _kinds(inference)
    else:
        document["surprise"] = surprise(chain).tolist()
        document["explanations"] = [_entry(inference, explanation) for explanation in best_explanations(chain, k)]
    if samples:
        drawn = sample_explanations(chain, samples, np.random.default_rng(np.random.SeedSequence(seed)))
        document["samples"] = [_entry(inference, explanation) for explanation in drawn]
    if smooth:
        document["smoothed"] = smoothed(inference)
    if options.write_json(document, json_file):
        console = options.console()
        for kind in document.get("kinds", []):
            console.print(f"{kind['probability']:.3f}  {kind['kind']}", soft_wrap=True)
        console.print(_explanations_table(f"{file}: most probable explanations", document["explanations"]))
        if samples:
            console.print(_explanations_table("drawn from the posterior", document["samples"]))
        console.print("surprise of each look, nats: " + ", ".join(f"{value:.3f}" for value in document["surprise"]))
        if smooth:
            console.print(_smoothed_table(document["smoothed"]))


def _with_memory(script: ScriptedTrial, file: Path) -> ScriptedTrial:
    """Return a script with another memory, and the parameters that let it use what it has learned of kinds."""
    memory = memory_files.load_memory(file)
    if memory.assumptions != script.memory.assumptions:
        raise InvalidInputError(f"--memory: {file} was made under other assumptions; expected those of {script.place}")
    return replace(script, memory=memory, parameters=replace(script.parameters, learn_structure=True))


def _kinds(inference: LearnedStructure) -> list[dict[str, Any]]:
    """Return what kind of thing it may be, the most probable first."""
    belief = inference.kind_belief()
    known = {kind.words: kind for kind in kinds_of(inference.memory)}
    return [
        {"kind": str(known.get(words, words)), "probability": belief[words]}
        for words in sorted(belief, key=lambda words: -belief[words])
        if belief[words] > LEAST_SHOWN
    ]


def _entry_of_kind(inference: Inference, explanation: KindExplanation) -> dict[str, Any]:
    """Return an explanation with names, as ``_entry`` does, and what kind of thing it is by that."""
    patterns = inference.memory.assumptions.alphabet.patterns
    return {
        "kind": explanation.kind,
        "object": (*inference.memory.names, None)[explanation.hypothesis],
        "aspects": [list(patterns[shown]) if shown >= 0 else None for shown in explanation.patterns],
        "probability": explanation.probability,
    }


def _entry(inference: Inference, explanation: Explanation) -> dict[str, Any]:
    """Return an explanation with names: the object's, and the pattern of each aspect, null for the collection node."""
    patterns = inference.memory.assumptions.alphabet.patterns
    shown = inference.model.pattern_of[explanation.hypothesis]
    return {
        "object": (*inference.memory.names, None)[explanation.hypothesis],
        "aspects": [list(patterns[shown[state]]) if shown[state] >= 0 else None for state in explanation.states],
        "probability": explanation.probability,
    }


def _explanations_table(title: str, entries: list[dict[str, Any]]) -> Table:
    table = Table(title=title, title_justify="left")
    of_kinds = ["kind"] if any("kind" in entry for entry in entries) else []
    for heading in ("probability", "object", *of_kinds, "aspects"):
        table.add_column(heading)
    for entry in entries:
        unknown = "unknown" if of_kinds else "collection"
        path = " → ".join(unknown if aspect is None else str(tuple(aspect)) for aspect in entry["aspects"])
        kind = [entry["kind"]] if of_kinds else []
        table.add_row(f"{entry['probability']:.6g}", entry["object"] or "unseen", *kind, path)
    return table


def _smoothed_table(document: dict[str, Any]) -> Table:
    table = Table(title=f"aspects of {document['object'] or 'unseen'} given all evidence", title_justify="left")
    for heading in ("step", "most probable aspects", "collection node"):
        table.add_column(heading)
    for step in document["steps"]:
        best = sorted(step["aspects"], key=lambda aspect: -float(aspect["probability"]))[:3]
        texts = (f"{tuple(aspect['pattern'])} {aspect['probability']:.3f}" for aspect in best)
        table.add_row(str(step["step"]), ", ".join(texts), f"{step['collection']:.3f}")
    return table
