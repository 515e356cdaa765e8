"""What was sampled from raw trials as a section of a memory file, checked on the way in."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.checks import number, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray
from atg_fg.learning.detector_noise import MAX_BINS, DetectorNoise
from atg_fg.learning.evidence_learner import MOST_RIVALS, SavedEvidence
from atg_fg.learning.raw_trials import RawTrial, Reassignment
from atg_fg.learning.saved_chain import SavedChain
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage.checked_json import read_array, read_entries, read_list, read_object
from atg_fg.storage.structure_json import read_structure, write_structure

#: Chains, and states of an automaton, that a file may have.
_MAX_CHAINS: Final = 64
_MAX_STATES: Final = 64
_CHAIN: Final = ("owner", "start", "slips", "slip", "score")


def write_evidence(memory: StructuredMemory) -> dict[str, Any]:
    """Return what was sampled, and which trials were given to other ATGs, as JSON knows it; empty if nothing was."""
    section: dict[str, Any] = {}
    saved = memory.evidence.saved()
    if saved is not None:
        noise = saved.noise
        section = {
            "sampled": saved.n_trials,
            "log_evidence": saved.log_evidence,
            "weights": list(saved.weights),
            "noise": {
                "wrong": noise.wrong,
                "alone": noise.alone,
                "edges": noise.edges.tolist(),
                "right": noise.right.tolist(),
                "confusion": noise.confusion.tolist(),
            },
            "chains": [_write_chain(chain, memory.assumptions) for chain in saved.chains],
        }
        if memory.assumptions.alphabet.exclusive:
            section["gain"] = memory.gain
    if memory.reassignments:
        section["reassignments"] = [list(each) for each in memory.reassignments]
    return section


def _write_chain(chain: SavedChain, assumptions: Assumptions) -> dict[str, Any]:
    structure: dict[str, Any] = (
        {"successors": [list(each) for each in chain.successors]}
        if chain.maps is None
        else {"maps": write_structure(chain.maps, assumptions)}
    )
    if chain.own:
        structure["own"] = [[cluster, [list(each) for each in successors]] for cluster, successors in chain.own]
    if chain.rival is not None:
        structure["rival"] = list(chain.rival)
    return {
        **structure,
        "owner": list(chain.owner),
        "start": list(chain.start),
        "slips": [list(each) for each in chain.slips],
        "slip": chain.slip,
        "score": chain.score,
        "wrong": [list(each) for each in chain.wrong],
        "error": chain.error,
    }


def read_evidence(value: Any, memory: StructuredMemory, place: str) -> None:
    """Let a memory, whose raw trials are there, go on from what is at ``place``.

    Raises:
        InvalidInputError: Anything malformed; the message names the place.
    """
    parts = ("sampled", "log_evidence", "weights", "noise", "chains")
    fields = read_object(value, place, (), (*parts, "gain", "reassignments"))
    trials = memory.learner.trials
    events = read_entries(fields.get("reassignments", []), f"{place}.reassignments")
    reassignments = [_read_event(event, len(trials), where) for event, where in events]
    saved, gain = None, None
    if set(parts) & set(fields):
        missing = [part for part in parts if part not in fields]
        if missing:
            raise InvalidInputError(f"{place}: no {missing[0]!r}; expected {', '.join(parts)}")
        saved = _read_saved(fields, memory, place)
        gain = number(fields["gain"], f"{place}.gain") if "gain" in fields else None
    memory.restore_evidence(saved, gain, reassignments)


def _read_saved(fields: dict[str, Any], memory: StructuredMemory, place: str) -> SavedEvidence:
    trials = memory.learner.trials
    sampled = whole_number(fields["sampled"], f"{place}.sampled", 1, len(trials))
    entries = read_entries(fields["chains"], f"{place}.chains")
    if not 1 <= len(entries) <= _MAX_CHAINS:
        raise InvalidInputError(f"{place}.chains: {len(entries)}; expected 1 to {_MAX_CHAINS}")
    chains = [_read_chain(entry, memory.assumptions, trials[:sampled], where) for entry, where in entries]
    weights = _numbers(fields["weights"], (len(chains),), 0.0, 1.0, f"{place}.weights")
    noise = _read_noise(fields["noise"], memory.assumptions.alphabet.n_symbols, f"{place}.noise")
    log_evidence = number(fields["log_evidence"], f"{place}.log_evidence")
    return SavedEvidence(tuple(chains), tuple(weights.tolist()), noise, sampled, log_evidence)


def _read_noise(value: Any, n_symbols: int, place: str) -> DetectorNoise:
    # What looks are wrong as a whole is not in files of before.
    fields = read_object(value, place, ("wrong", "edges", "right", "confusion"), ("alone",))
    n_bins = len(read_list(fields["right"], f"{place}.right"))
    if not 1 <= n_bins <= MAX_BINS:
        raise InvalidInputError(f"{place}.right: {n_bins} bins; expected 1 to {MAX_BINS}")
    edges = _numbers(fields["edges"], (n_bins - 1,), -np.inf, np.inf, f"{place}.edges")
    if np.any(np.diff(edges) <= 0):
        raise InvalidInputError(f"{place}.edges: {edges.tolist()}; expected them in ascending order")
    return DetectorNoise(
        edges,
        _numbers(fields["right"], (n_bins,), 0.0, 1.0, f"{place}.right"),
        _numbers(fields["confusion"], (n_symbols, n_symbols), 0.0, 1.0, f"{place}.confusion"),
        number(fields["wrong"], f"{place}.wrong", 0.0, 1.0),
        number(fields.get("alone", DetectorNoise.alone), f"{place}.alone", 1e-12, 1.0 - 1e-12),
    )


def _read_chain(value: Any, assumptions: Assumptions, trials: Sequence[RawTrial], place: str) -> SavedChain:
    fields = read_object(value, place, _CHAIN, ("maps", "successors", "own", "rival", "wrong", "error"))
    if ("maps" in fields) == ("successors" in fields):
        raise InvalidInputError(f"{place}: expected either maps or successors")
    maps, successors = None, np.zeros((0, 0), dtype=np.int64)
    if "maps" in fields:
        maps = read_structure(fields["maps"], assumptions, f"{place}.maps")
        n_states = len(maps.poses().registers)
    else:
        rows = read_list(fields["successors"], f"{place}.successors")
        n_states = len(read_list(rows[0], f"{place}.successors[0]")) if rows else 0
        if not 1 <= n_states <= _MAX_STATES:
            raise InvalidInputError(f"{place}.successors: {n_states} states; expected 1 to {_MAX_STATES}")
        shape = (len(assumptions.actions), n_states)
        successors = _whole(fields["successors"], shape, n_states - 1, f"{place}.successors")
    n_trials = len(trials)
    own = read_entries(fields.get("own", []), f"{place}.own")
    rival = None
    if "rival" in fields:
        group, evidence = read_list(fields["rival"], f"{place}.rival", 2)
        rival = (whole_number(group, f"{place}.rival[0]", 0, MOST_RIVALS - 1), number(evidence, f"{place}.rival[1]"))
    slips = read_entries(fields["slips"], f"{place}.slips")
    wrong = read_entries(fields.get("wrong", []), f"{place}.wrong")
    return SavedChain(
        maps,
        tuple(map(tuple, successors.tolist())),
        tuple(_read_own(each, n_trials, successors.shape, where) for each, where in own),
        tuple(_whole(fields["owner"], (n_trials,), n_trials + 1, f"{place}.owner").tolist()),
        tuple(_whole(fields["start"], (n_trials,), n_states - 1, f"{place}.start").tolist()),
        tuple(_read_slip(slip, trials, where) for slip, where in slips),
        number(fields["slip"], f"{place}.slip", 1e-12, 1.0 - 1e-12),
        number(fields["score"], f"{place}.score"),
        rival,
        tuple(_read_wrong(look, trials, where) for look, where in wrong),
        number(fields.get("error", SavedChain._field_defaults["error"]), f"{place}.error", 1e-12, 1.0 - 1e-12),
    )


def _read_own(value: Any, n_trials: int, shape: tuple[int, ...], place: str) -> tuple[int, tuple[tuple[int, ...], ...]]:
    cluster, successors = read_list(value, place, 2)
    if not shape[0]:
        raise InvalidInputError(f"{place}: an automaton beside maps; expected none")
    table = _whole(successors, shape, shape[1] - 1, f"{place}[1]")
    return whole_number(cluster, f"{place}[0]", 0, n_trials + 1), tuple(map(tuple, table.tolist()))


def _read_slip(value: Any, trials: Sequence[RawTrial], place: str) -> tuple[int, int]:
    trial, action = read_list(value, place, 2)
    number_of_trial = whole_number(trial, f"{place}[0]", 0, len(trials) - 1)
    n_actions = len(trials[number_of_trial].actions)
    if not n_actions:
        raise InvalidInputError(f"{place}: trial {number_of_trial} has no action; expected one that has")
    return number_of_trial, whole_number(action, f"{place}[1]", 0, n_actions - 1)


def _read_wrong(value: Any, trials: Sequence[RawTrial], place: str) -> tuple[int, int]:
    trial, look = read_list(value, place, 2)
    number_of_trial = whole_number(trial, f"{place}[0]", 0, len(trials) - 1)
    return number_of_trial, whole_number(look, f"{place}[1]", 0, len(trials[number_of_trial].detections) - 1)


def _read_event(value: Any, n_trials: int, place: str) -> Reassignment:
    entries = read_list(value, place)
    if len(entries) != 4 or not all(isinstance(name, str) for name in entries[2:]):
        raise InvalidInputError(f"{place}: {value!r:.80}; expected two numbers and two names")
    after = whole_number(entries[0], f"{place}[0]", 1, n_trials)
    return Reassignment(after, whole_number(entries[1], f"{place}[1]", 0, n_trials - 1), entries[2], entries[3])


def _whole(value: Any, shape: tuple[int, ...], most: int, place: str) -> np.ndarray[Any, np.dtype[np.int64]]:
    entries = read_array(value, place, shape, lambda entry, where: whole_number(entry, where, 0, most))
    return np.array(entries, dtype=np.int64)


def _numbers(value: Any, shape: tuple[int, ...], least: float, most: float, place: str) -> FloatArray:
    return np.array(read_array(value, place, shape, lambda entry, where: number(entry, where, least, most)))
