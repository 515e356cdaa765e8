"""How probable whole trials are under a structure, and what they teach of the contents of their objects."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from atg_fg.core.patterns import MISSING, FloatArray, PatternAlphabet
from atg_fg.learning.pose_filter import PoseFilter
from atg_fg.learning.rates import FAILED, Rates
from atg_fg.learning.raw_trials import RawTrial
from atg_fg.learning.shared_structure import SharedStructure

#: What a trial's evidence is given: an object never met, the object that it is filed under, or all trials before it,
#: its object summed out.
NEW, FILED, BEFORE = range(3)


class TrialScores(NamedTuple):
    """What N trials say under a structure.

    Attributes:
        log_evidence: ln p(trial | structure, what was known of its object), shape [N].
        events: Expected numbers, columns as ``atg_fg.learning.rates`` has them, shape [N, FAILED].
        contents: What is known of the objects after the trials, shape [N, P, S].
    """

    log_evidence: FloatArray
    events: FloatArray
    contents: FloatArray


def score_trials(
    structure: SharedStructure,
    trials: Sequence[RawTrial],
    rates: Rates,
    alphabet: PatternAlphabet,
    contents: FloatArray | None = None,
) -> TrialScores:
    """Return what trials say under a structure.

    Args:
        structure: With at most as many poses as a structure may have.
        trials: Raw trials of N objects.
        rates: Slip, wrong looks and repeated symbols.
        alphabet: The patterns.
        contents: What is known of the objects before, shape [N, P, S]; nothing if not given: fresh objects.
    """
    shape = (len(trials), structure.n_registers, alphabet.n_symbols)
    before = np.zeros(shape) if contents is None else contents
    scores = TrialScores(np.zeros(len(trials)), np.zeros((len(trials), FAILED)), np.empty(shape))
    by_length: defaultdict[int, list[int]] = defaultdict(list)
    for number, trial in enumerate(trials):
        by_length[len(trial.actions)].append(number)
    for numbers in by_length.values():
        own = PoseFilter(structure.poses(), before[numbers], rates, alphabet)
        follow(own, [trials[number] for number in numbers], alphabet)
        scores.log_evidence[numbers] = own.log_evidence
        scores.events[numbers] = own.expected_events()
        learned, is_possible = own.learned()
        scores.contents[numbers] = np.where(is_possible[:, None, None], learned, before[numbers])
    return scores


def follow(own: PoseFilter, trials: Sequence[RawTrial], alphabet: PatternAlphabet) -> None:
    """Let a filter go through trials of the same length, one of each owner."""
    seen = np.concatenate([trial.symbols for trial in trials], axis=1)
    looks = seen.reshape(len(seen), len(trials), -1)
    actions = np.array([trial.actions for trial in trials], dtype=np.int64).T.copy()
    if (looks != MISSING).all():
        own.follow(actions, looks)
        return
    for look, symbols in enumerate(looks):
        if look:
            own.act_apart(actions[look - 1])
        if (symbols != MISSING).all():
            own.observe_pattern(symbols)
        else:
            agrees = (symbols[:, None, :] == MISSING) | (symbols[:, None, :] == alphabet.symbols)
            own.observe_likelihood(agrees.all(axis=2).astype(np.float64))
