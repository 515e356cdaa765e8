"""What a learner has learned as a section of a memory file, checked on the way in.

Raw trials, the structures in question and the rates in force are kept; scores and contents follow from them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from atg_fg.assumptions import Assumptions
from atg_fg.errors import InvalidInputError
from atg_fg.json_format import read_integer, read_list, read_object
from atg_fg.structure.learner import MAX_CANDIDATES, StructureLearner
from atg_fg.structure.rates import Rates
from atg_fg.structure.shared_structure import read_structure, write_structure
from atg_fg.structure.trials import RawTrial


def write_learner(learner: StructureLearner, first: int = 0) -> dict[str, Any]:
    """Return a learner as JSON knows it, with its raw trials from number ``first`` on."""
    names = learner.assumptions.actions
    return {
        "seed": learner.seed,
        "evaluations": learner.n_evaluations,
        "rates": learner.rates.to_json(),
        "candidates": [write_structure(structure, learner.assumptions) for structure in learner.candidates],
        "trials": [
            {
                "object": owner,
                "observed": [list(detection) for detection in trial.detections],
                "actions": [names[action] for action in trial.actions],
            }
            for owner, trial in zip(learner.owners[first:], learner.trials[first:], strict=True)
        ],
    }


def read_learner(value: Any, assumptions: Assumptions, names: Sequence[str], place: str) -> StructureLearner:
    """Return the learner at ``place``.

    Args:
        value: What the file has there.
        assumptions: Of the memory.
        names: Of the ATGs in the memory, which the trials are of.
        place: Where it is, for error messages.

    Raises:
        InvalidInputError: Anything malformed; the message names the place.
    """
    fields = read_object(value, place, ("seed", "rates", "candidates", "trials"), optional=("evaluations",))
    learner = StructureLearner(assumptions, read_integer(fields["seed"], f"{place}.seed", least=0))
    learner.n_evaluations = read_integer(fields.get("evaluations", 0), f"{place}.evaluations", least=0)
    candidates = read_list(fields["candidates"], f"{place}.candidates")
    if len(candidates) > MAX_CANDIDATES:
        raise InvalidInputError(f"{place}.candidates: {len(candidates)} structures; expected at most {MAX_CANDIDATES}")
    structures = [
        read_structure(candidate, assumptions, f"{place}.candidates[{index}]")
        for index, candidate in enumerate(candidates)
    ]
    rates = Rates.from_json(fields["rates"], f"{place}.rates")
    entries = read_list(fields["trials"], f"{place}.trials")
    trials = [_read_trial(entry, assumptions, names, f"{place}.trials[{index}]") for index, entry in enumerate(entries)]
    learner.restore([owner for owner, _ in trials], [trial for _, trial in trials], structures, rates)
    return learner


def _read_trial(value: Any, assumptions: Assumptions, names: Sequence[str], place: str) -> tuple[str, RawTrial]:
    """Return the name of a trial's object, and the trial."""
    fields = read_object(value, place, ("object", "observed", "actions"))
    owner = fields["object"]
    if not isinstance(owner, str) or owner not in names:
        raise InvalidInputError(f"{place}.object: {owner!r}; expected the name of an ATG in this memory")
    looks = read_list(fields["observed"], f"{place}.observed")
    detections = tuple(
        assumptions.alphabet.check_detection(read_list(look, where), where)
        for look, where in ((look, f"{place}.observed[{index}]") for index, look in enumerate(looks))
    )
    actions = tuple(
        assumptions.action_index(name, f"{place}.actions[{index}]")
        for index, name in enumerate(read_list(fields["actions"], f"{place}.actions"))
    )
    trial = RawTrial(detections, actions)
    trial.check(assumptions, place)
    return owner, trial
