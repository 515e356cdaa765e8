"""What a learner has learned as a section of a memory file, checked on the way in.

Raw trials, the structures in question and the rates in force are kept; scores and contents follow from them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.checks import number, whole_number
from atg_fg.core.errors import InvalidInputError, TooLargeError, placed
from atg_fg.core.patterns import Detection, SlotLikelihoods
from atg_fg.core.slot_checks import check_confidences, check_slots
from atg_fg.learning.kinds import MAX_KINDS
from atg_fg.learning.learner import MAX_CANDIDATES, StructureLearner
from atg_fg.learning.plain_evidence import UNCERTAIN, USUAL, PlainNoise
from atg_fg.learning.rates import PRIORS, Rates
from atg_fg.learning.raw_trials import RawTrial
from atg_fg.learning.shared_structure import SharedStructure
from atg_fg.storage.checked_json import read_entries, read_list, read_object
from atg_fg.storage.object_sense_json import read_readings, write_readings


def write_learner(learner: StructureLearner, first: int = 0) -> dict[str, Any]:
    """Return a learner as JSON knows it, with its raw trials from number ``first`` on."""
    names = learner.assumptions.actions
    return {
        "seed": learner.seed,
        "evaluations": learner.n_evaluations,
        "rates": learner.rates.by_name(),
        **({"uncertain": learner.noise._asdict()} if learner.noise != USUAL else {}),
        "candidates": [write_structure(structure, learner.assumptions) for structure in learner.candidates],
        "trials": [
            {
                "object": owner,
                "observed": _write_looks(trial),
                "actions": [names[action] for action in trial.actions],
                **({"confidences": [list(each) for each in trial.confidences]} if trial.confidences else {}),
                **({"measured": write_readings(trial.measured)} if trial.measured else {}),
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
    fields = read_object(
        value, place, ("seed", "rates", "candidates", "trials"), optional=("evaluations", "evidence", "uncertain")
    )
    learner = StructureLearner(assumptions, whole_number(fields["seed"], f"{place}.seed", least=0))
    learner.n_evaluations = whole_number(fields.get("evaluations", 0), f"{place}.evaluations", least=0)
    candidates = read_entries(fields["candidates"], f"{place}.candidates")
    if len(candidates) > MAX_CANDIDATES + MAX_KINDS:
        raise InvalidInputError(
            f"{place}.candidates: {len(candidates)} structures; expected at most {MAX_CANDIDATES + MAX_KINDS}"
        )
    structures = [read_structure(candidate, assumptions, where) for candidate, where in candidates]
    rates = _read_rates(fields["rates"], f"{place}.rates")
    entries = read_entries(fields["trials"], f"{place}.trials")
    trials = [_read_trial(entry, assumptions, names, where) for entry, where in entries]
    noise = _read_noise(fields["uncertain"], f"{place}.uncertain") if "uncertain" in fields else USUAL
    learner.restore([owner for owner, _ in trials], [trial for _, trial in trials], structures, rates, noise)
    return learner


def _read_noise(value: Any, place: str) -> PlainNoise:
    """Return α and δ of objects whose actions are uncertain, one of those that are learned."""
    fields = read_object(value, place, PlainNoise._fields)
    noise = PlainNoise(*(number(fields[name], f"{place}.{name}", 0.0) for name in PlainNoise._fields))
    if noise not in UNCERTAIN:
        concentrations, noises = (sorted({each[part] for each in UNCERTAIN}) for part in (0, 1))
        raise InvalidInputError(
            f"{place}: concentration {noise.concentration}, noise {noise.noise}; "
            f"expected one of {concentrations} and one of {noises}"
        )
    return noise


def _read_trial(value: Any, assumptions: Assumptions, names: Sequence[str], place: str) -> tuple[str, RawTrial]:
    """Return the name of a trial's object, and the trial."""
    fields = read_object(value, place, ("object", "observed", "actions"), ("confidences", "measured"))
    owner = fields["object"]
    if not isinstance(owner, str) or owner not in names:
        raise InvalidInputError(f"{place}.object: {owner!r}; expected the name of an ATG in this memory")
    observed = read_entries(fields["observed"], f"{place}.observed")
    looks = [_read_look(look, assumptions, where) for look, where in observed]
    done = read_entries(fields["actions"], f"{place}.actions")
    actions = tuple(assumptions.action_index(name, where) for name, where in done)
    stated = read_entries(fields.get("confidences", []), f"{place}.confidences")
    n_slots = len(assumptions.alphabet.slots)
    confidences = tuple(check_confidences(read_list(look, where), n_slots, where) for look, where in stated)
    likelihoods = tuple(slots for _, slots in looks)
    detections = tuple(detection for detection, _ in looks)
    measured = read_readings(fields.get("measured", []), assumptions.object_senses, f"{place}.measured")
    trial = RawTrial(detections, actions, confidences, likelihoods if any(likelihoods) else (), measured)
    trial.check(assumptions, place)
    return owner, trial


def _write_looks(trial: RawTrial) -> list[list[Any]]:
    """Return what was seen: in each slot a symbol, null, or a list with the likelihood of each symbol."""
    looks: list[list[Any]] = [list(detection) for detection in trial.detections]
    for look, slots in zip(looks, trial.likelihoods, strict=False):
        for slot, weights in enumerate(slots):
            if weights is not None:
                look[slot] = list(weights)
    return looks


def _read_look(value: Any, assumptions: Assumptions, place: str) -> tuple[Detection, SlotLikelihoods]:
    entries = read_list(value, place)
    labels = [None if isinstance(entry, list) else entry for entry in entries]
    detection = assumptions.alphabet.check_detection(labels, place)
    if not any(isinstance(entry, list) for entry in entries):
        return detection, ()
    for slot, entry in zip(assumptions.alphabet.slots, entries, strict=True):
        if isinstance(entry, list):
            for weight in entry:
                number(weight, f"{place}, slot {slot!r}", 0.0)
    weights = [entry if isinstance(entry, list) else None for entry in entries]
    return detection, check_slots(weights, assumptions.alphabet.slots, assumptions.alphabet.n_symbols, place)


#: Hidden registers that a file may name; far above what can be learned.
MAX_REGISTERS: Final = 64

#: The same of modes.
MAX_FILE_MODES: Final = 8


def write_structure(structure: SharedStructure, assumptions: Assumptions) -> dict[str, Any]:
    """Return a structure as JSON knows it; of several modes it has a list with the maps and the next modes of each."""
    names = assumptions.actions
    maps = [
        {name: list(structure.step(mode, action)[1]) for action, name in enumerate(names)}
        for mode in range(structure.n_modes)
    ]
    if structure.n_modes == 1:
        return {"registers": structure.n_registers, "sources": maps[0]}
    modes = [
        {"sources": sources, "next": dict(zip(names, following, strict=True))}
        for sources, following in zip(maps, structure.next_modes, strict=True)
    ]
    return {"registers": structure.n_registers, "modes": modes}


def read_structure(value: Any, assumptions: Assumptions, place: str) -> SharedStructure:
    """Return the structure at ``place``, in canonical form.

    Raises:
        InvalidInputError: It is none for these slots and actions; the message names the place.
    """
    has_modes = isinstance(value, dict) and "modes" in value
    fields = read_object(value, place, ("registers", "modes" if has_modes else "sources"))
    n_registers = whole_number(fields["registers"], f"{place}.registers", least=len(assumptions.alphabet.slots))
    if n_registers > MAX_REGISTERS:
        raise InvalidInputError(f"{place}.registers: {n_registers}; expected at most {MAX_REGISTERS}")
    next_modes: tuple[tuple[int, ...], ...] = ()
    if has_modes:
        modes = read_entries(fields["modes"], f"{place}.modes")
        if not 2 <= len(modes) <= MAX_FILE_MODES:
            raise InvalidInputError(f"{place}.modes: {len(modes)}; expected 2 to {MAX_FILE_MODES} of them")
        each = [(read_object(mode, where, ("sources", "next")), where) for mode, where in modes]
        maps = [
            source
            for mode, where in each
            for source in _read_maps(mode["sources"], n_registers, assumptions, f"{where}.sources")
        ]
        next_modes = tuple(
            _read_next_modes(mode["next"], len(modes), assumptions, f"{where}.next") for mode, where in each
        )
    else:
        maps = _read_maps(fields["sources"], n_registers, assumptions, f"{place}.sources")
    structure = SharedStructure(len(assumptions.alphabet.slots), tuple(maps), next_modes).canonical()
    try:
        structure.poses()
    except TooLargeError as error:
        raise InvalidInputError(f"{place}: {error}") from error
    return structure


def _read_maps(value: Any, n_registers: int, assumptions: Assumptions, place: str) -> list[tuple[int, ...]]:
    by_action = read_object(value, place, assumptions.actions)
    return [_read_sources(by_action[name], n_registers, f"{place}.{name}") for name in assumptions.actions]


def _read_next_modes(value: Any, n_modes: int, assumptions: Assumptions, place: str) -> tuple[int, ...]:
    by_action = read_object(value, place, assumptions.actions)
    return tuple(whole_number(by_action[name], f"{place}.{name}", 0, n_modes - 1) for name in assumptions.actions)


def _read_sources(value: Any, n_registers: int, place: str) -> tuple[int, ...]:
    sources = tuple(whole_number(entry, where, least=0) for entry, where in read_entries(value, place))
    if len(sources) != n_registers or max(sources) >= n_registers:
        raise InvalidInputError(f"{place}: {list(sources)}; expected {n_registers} numbers of 0 to {n_registers - 1}")
    return sources


def _read_rates(value: Any, place: str) -> Rates:
    """Return the rates at ``place``, or raise ``InvalidInputError`` naming it."""
    fields = read_object(value, place, tuple(PRIORS.keys() - {"slip_again"}), optional=("slip_again",))
    with placed(place):
        return Rates(**fields)
