"""Repair of a structure that a trial contradicts: two entries of one map change places.

Merging fills up what no trial says of a map, and few trials may leave entries open that later ones need. Then a trial
seems to have a wrong look or a slip. Which trials follow a structure without any error is quickly told, with no poses
made; exact evidence decides between what is proposed here.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace

from atg_fg.learning.raw_trials import RawTrial
from atg_fg.learning.shared_structure import SharedStructure


def repairs(structure: SharedStructure, contradicting: RawTrial, trials: Sequence[RawTrial]) -> list[SharedStructure]:
    """Return structures that a trial follows which contradicts this one, those first that most trials follow.

    More trials follow each of them than follow the structure itself; they are in canonical form.

    Args:
        structure: Differs from each of them in two entries of one map.
        contradicting: Is had with an error under the structure.
        trials: To count.
    """
    proposed = [other for other in _neighbours(structure) if follows(contradicting, other)]
    if not proposed:
        return []
    at_present = _n_followers(structure, trials)
    numbers = {other.canonical(): _n_followers(other, trials) for other in proposed}
    return sorted((other for other in numbers if numbers[other] > at_present), key=lambda other: -numbers[other])


def follows(trial: RawTrial, structure: SharedStructure) -> bool:
    """Return whether a trial of a fresh object, upright in some mode at first, may be had without any error."""
    return any(_follows_from(mode, trial, structure) for mode in range(structure.n_modes))


def _n_followers(structure: SharedStructure, trials: Sequence[RawTrial]) -> int:
    return sum(follows(trial, structure) for trial in trials)


def _follows_from(mode: int, trial: RawTrial, structure: SharedStructure) -> bool:
    places = list(range(structure.n_registers))
    holds: dict[int, int] = {}
    held_by: dict[int, int] = {}
    for time, detection in enumerate(trial.detections):
        if time:
            mode, sources = structure.step(mode, trial.actions[time - 1])
            places = [places[source] for source in sources]
        for register, symbol in zip(places, detection, strict=False):
            if symbol is not None and (
                holds.setdefault(register, symbol) != symbol or held_by.setdefault(symbol, register) != register
            ):
                return False
    return True


def _neighbours(structure: SharedStructure) -> Iterator[SharedStructure]:
    maps = structure.sources
    for number, sources in enumerate(maps):
        for one, two in itertools.combinations(range(structure.n_registers), 2):
            if sources[one] != sources[two]:
                changed = list(sources)
                changed[one], changed[two] = sources[two], sources[one]
                yield replace(structure, sources=(*maps[:number], tuple(changed), *maps[number + 1 :]))
