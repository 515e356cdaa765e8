"""``atg-fg uai``: solve discrete factor graphs in the UAI format, and write trials as such."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from atg_fg.cli import options
from atg_fg.cli.terminal import say
from atg_fg.core.errors import InvalidInputError
from atg_fg.inference.elimination import queries
from atg_fg.inference.elimination.discrete_model import DiscreteModel
from atg_fg.storage import plain_files
from atg_fg.storage.scripted_trial import read_script
from atg_fg.storage.uai import read_evidence, read_model, write_evidence, write_model
from atg_fg.storage.uai_export import export_trial

app = typer.Typer(
    help="Solve discrete factor graphs in the UAI format, and write trials as such. "
    "Example: atg-fg uai solve trial.uai --evidence trial.uai.evid --task MAR",
    no_args_is_help=True,
)

#: The line of a result, and the result as JSON has it.
_Answer = tuple[str, dict[str, Any]]


@app.command()
def solve(
    model: Annotated[Path, options.argument(help="A model in the UAI format.")],
    task: Annotated[
        str, typer.Option(help="MAR: marginals; PR: log10 of the partition function; MPE: most probable explanation.")
    ],
    evidence: Annotated[Path | None, typer.Option(help="Evidence in the UAI format.")] = None,
    limit: Annotated[
        int, typer.Option(min=1, help="Refuse if tables would have more entries; 8 bytes each.")
    ] = queries.DEFAULT_LIMIT,
    json_file: options.JsonFile = None,
) -> None:
    """Solve a model exactly and print the result in the format of the UAI competitions.

    Example: atg-fg uai solve grid.uai --evidence grid.uai.evid --task MAR
    """
    if task not in TASKS:
        raise InvalidInputError(f"--task: {task!r}; expected one of: {', '.join(TASKS)}")
    read = read_model(plain_files.read_text_file(model), str(model), _note)
    observed: dict[int, int] = {}
    if evidence is not None:
        observed = read_evidence(plain_files.read_text_file(evidence), str(evidence), _note)
        read.check_evidence(observed, str(evidence))
    line, answer = TASKS[task](read, observed, limit)
    if options.write_json({"command": "uai solve", "model": str(model), "task": task, **answer}, json_file):
        say(task, line)


def _note(note: str) -> None:
    say(f"atg-fg: {note}", err=True)


def _partition(model: DiscreteModel, evidence: dict[int, int], limit: int) -> _Answer:
    logarithm = queries.log_partition(model, evidence, limit)
    return repr(logarithm / math.log(10)), {"log10_partition": logarithm / math.log(10), "log_partition": logarithm}


def _marginals(model: DiscreteModel, evidence: dict[int, int], limit: int) -> _Answer:
    marginals = [marginal.tolist() for marginal in queries.marginals(model, evidence, limit)]
    words = [str(len(marginals))]
    for marginal in marginals:
        words += [str(len(marginal)), *map(repr, marginal)]
    return " ".join(words), {"marginals": marginals}


def _explanation(model: DiscreteModel, evidence: dict[int, int], limit: int) -> _Answer:
    states, log_weight = queries.most_probable_explanation(model, evidence, limit)
    return " ".join(map(str, (len(states), *states))), {"states": list(states), "log_weight": log_weight}


TASKS: dict[str, Callable[[DiscreteModel, dict[int, int], int], _Answer]] = {
    "MAR": _marginals,
    "PR": _partition,
    "MPE": _explanation,
}


@app.command()
def export(
    script: Annotated[Path, options.argument(help="A scripted trial (JSON).")],
    model: Annotated[
        Path, options.written(help="Write the trial's factor graph to this file."), plain_files.check_writable
    ],
    evidence: Annotated[Path, options.written(help="Write what was seen to this file."), plain_files.check_writable],
) -> None:
    """Write the factor graph of a scripted trial and its evidence in the UAI format.

    Example: atg-fg uai export trial.json --model trial.uai --evidence trial.uai.evid
    """
    exported = export_trial(read_script(plain_files.read_text_file(script), str(script)))
    plain_files.write_bytes_atomically(model, write_model(exported.model).encode())
    plain_files.write_bytes_atomically(evidence, write_evidence(exported.evidence).encode())
    say(f"{model}: {len(exported.names)} variables, {', '.join(exported.names)}; {len(exported.model.factors)} factors")
