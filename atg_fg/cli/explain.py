"""``atg-fg explain``: how what was seen in a scripted trial can have come about."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.table import Table

from atg_fg.cli import options
from atg_fg.experiments.replay import run_script, smoothed
from atg_fg.inference.explanations import Explanation, best_explanations, sample_explanations, surprise
from atg_fg.inference.interface import Inference
from atg_fg.storage import plain_files
from atg_fg.storage.scripted_trial import read_script


def explain(
    file: Annotated[Path, typer.Argument(help="A scripted trial (JSON).", show_default=False)],
    k: Annotated[int, typer.Option("--k", min=1, help="How many explanations, the most probable first.")] = 5,
    samples: Annotated[int, typer.Option(min=0, help="How many explanations to draw from the posterior.")] = 0,
    smooth: Annotated[bool, typer.Option("--smooth", help="Add p(X_t | all evidence) of every look.")] = False,
    engine: options.Engine = "gtsam",
    seed: Annotated[int, typer.Option(min=0, help="Seed of the samples.")] = 0,
    json_file: options.JsonFile = None,
) -> None:
    """Print the most probable explanations of a trial (object and aspects), and how surprising each look was.

    Example: atg-fg explain tests/data/scripted_trial.json --k 3 --smooth
    """
    options.check_json_option(json_file)
    inference = run_script(read_script(plain_files.read_text_file(file), str(file)), engine)
    chain = inference.chain()
    best = best_explanations(chain, k)
    document: dict[str, Any] = {
        "command": "explain",
        "file": str(file),
        "log_evidence": inference.log_evidence,
        "surprise": surprise(chain).tolist(),
        "explanations": [_entry(inference, explanation) for explanation in best],
    }
    if samples:
        drawn = sample_explanations(chain, samples, np.random.default_rng(np.random.SeedSequence(seed)))
        document["samples"] = [_entry(inference, explanation) for explanation in drawn]
    if smooth:
        document["smoothed"] = smoothed(inference)
    options.write_json(document, json_file)
    if json_file != "-":
        console = options.console()
        console.print(_explanations_table(f"{file}: most probable explanations", document["explanations"]))
        if samples:
            console.print(_explanations_table("drawn from the posterior", document["samples"]))
        console.print("surprise of each look, nats: " + ", ".join(f"{value:.3f}" for value in document["surprise"]))
        if smooth:
            console.print(_smoothed_table(document["smoothed"]))


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
    for heading in ("probability", "object", "aspects"):
        table.add_column(heading)
    for entry in entries:
        path = " → ".join("collection" if aspect is None else str(tuple(aspect)) for aspect in entry["aspects"])
        table.add_row(f"{entry['probability']:.6g}", entry["object"] or "unseen", path)
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
