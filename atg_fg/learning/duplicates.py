"""Two ATGs of one object, as a false novelty leaves them: the odds that they are, and the pairs that most probably are.

The odds that j is the object i are prior odds times a Bayes factor. When j was made, each of the K − 1 other ATGs was
of its object with probability 1/N, and none of them with probability (N − K + 1)/N:

    ln odds = −ln max(N − K + 1, 1) + ln p(trials of j | trials of i, one object) − ln p(trials of j | another object)

Without a learned structure the trials are what the ATGs counted, first looks and transitions, weighed by the plain
model that learns as it goes. With one, an object follows structure S with probability ρ, and the factor is

    Σ_S w_S (ρ_i ρ_j / π · B_S + (1 − ρ_i) (1 − ρ_j) / (1 − π) · B_0) + w_none B_0

where B_S is the factor of the raw trials of j given the contents of i, B_0 that of the plain model, w the weight of
each structure and of none, and π the share of objects that follow a structure. What was felt of the objects as a whole,
such as their weight, is a factor of its own.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.log_math import log_of
from atg_fg.core.memory import RobotMemory
from atg_fg.core.object_sense import Moments
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import FloatArray
from atg_fg.learning.believed_structure import BelievedStructure, UncertainObjects
from atg_fg.learning.learner import StructureLearner
from atg_fg.learning.likelihood import score_trials
from atg_fg.learning.structured_memory import StructuredMemory

#: Log odds above which two ATGs are taken for one object where a structure is believed in: a probability of 99 %.
STRUCTURED_LOG_ODDS: Final = math.log(99.0)
#: The same for plain ATGs. Their model takes the patterns that two objects share for independent; but two cubes with
#: the same two tags side by side share several at once, so it is too sure.
PLAIN_LOG_ODDS: Final = math.log(1e4)


@dataclass(frozen=True)
class Duplicate:
    """Two ATGs that are probably of one object.

    Attributes:
        keep: Name of the older ATG.
        drop: Name of the other one.
        log_odds: Ln of the odds that they are of one object.
    """

    keep: str
    drop: str
    log_odds: float


def find_duplicates(
    memory: RobotMemory, parameters: ModelParameters, threshold: float | None = None, of: Sequence[str] | None = None
) -> list[Duplicate]:
    """Return the pairs of ATGs whose log odds to be of one object are above a threshold, most probable first.

    Args:
        memory: With at most as many objects as the environment has, else there is no prior.
        parameters: α, δ, and whether a learned structure counts.
        threshold: In nats; ``STRUCTURED_LOG_ODDS`` or ``PLAIN_LOG_ODDS``, by the model in force, if not given.
        of: Names of ATGs; pairs without one of them are left out. All pairs if not given.

    Raises:
        InvalidInputError: The threshold is no number.
        UnknownNameError: There is no ATG of a name in ``of``.
    """
    if threshold is not None and not math.isfinite(threshold):
        raise InvalidInputError(f"threshold: {threshold}; expected a finite number")
    names, found = memory.names, []
    odds = _Odds(memory, parameters)
    least = odds.usual_threshold if threshold is None else threshold
    checked = range(len(names)) if of is None else [names.index(memory[name].name) for name in of]
    for index in checked:
        others = [other for other in range(len(names)) if (other < index if of is None else other != index)]
        for other, log_odds in zip(others, odds.of(index, others).tolist(), strict=True):
            if log_odds > least:
                keep, drop = sorted((index, other))
                found.append(Duplicate(names[keep], names[drop], log_odds))
    unique = {(each.keep, each.drop): each for each in found}
    return sorted(unique.values(), key=lambda each: (-each.log_odds, each.keep, each.drop))


def merge_duplicates(
    memory: RobotMemory, parameters: ModelParameters, of: str | None = None, threshold: float | None = None
) -> list[Duplicate]:
    """Merge duplicates, the most probable first, until none is left; return what was merged.

    They are looked for anew after each merge, for what was merged says more of the others.

    Args:
        memory: Changed in place; ``memory.unmerge`` undoes it.
        parameters: As for ``find_duplicates``.
        of: Name of the one ATG that is merged with its own, such as the one that has just learned; all if not given.
        threshold: As for ``find_duplicates``.
    """
    merged = []
    while found := find_duplicates(memory, parameters, threshold, None if of is None else [of]):
        memory.merge(found[0].keep, found[0].drop)
        merged.append(found[0])
        of = of and found[0].keep
    return merged


class _Odds:
    """The log odds of pairs in one memory."""

    def __init__(self, memory: RobotMemory, parameters: ModelParameters) -> None:
        self._memory, self._parameters, self._graphs = memory, parameters, list(memory)
        self._believed: list[BelievedStructure] = []
        self._uncertain: UncertainObjects | None = None
        self._learner = StructureLearner(memory.assumptions)
        if parameters.learn_structure and isinstance(memory, StructuredMemory):
            self._learner = memory.learner
            self._believed = memory.learner.believed(memory.names)
            self._uncertain = memory.learner.uncertain(memory.names)
        self._log_prior = -math.log(max(memory.assumptions.n_objects - len(memory) + 1, 1))

    @property
    def usual_threshold(self) -> float:
        """Log odds above which two ATGs are taken for one object."""
        is_structured = max((each.weight for each in self._believed), default=0.0) > 0.5
        return STRUCTURED_LOG_ODDS if is_structured else PLAIN_LOG_ODDS

    def of(self, index: int, others: Sequence[int]) -> FloatArray:
        """Return the log odds that an ATG is of the same object as each of the others, shape [len(others)]."""
        if not others:
            return np.zeros(0)
        plain: FloatArray = np.array([self._plain_factor(index, other, self._parameters) for other in others])
        felt: FloatArray = self._log_prior + np.array([self._felt_factor(index, other) for other in others])
        if not self._believed and self._uncertain is None:
            return felt + plain
        terms = []
        mine_plain, theirs_plain, plain_share = 1.0, np.ones(len(others)), 1.0
        for each in self._believed:
            mine, theirs = each.followers[index], each.followers[list(others)]
            weight = each.weight * mine * theirs / each.share
            both = log_of(weight)
            if (weight > 0).any():
                both = both + self._structure_factors(each, index, others)
            terms.append(both)
            mine_plain -= each.weight * mine
            theirs_plain = theirs_plain - each.weight * theirs
            plain_share -= each.weight * each.share
        if self._uncertain is not None:
            noise, members, share = self._uncertain
            uncertain = np.array([self._plain_factor(index, other, noise.parameters) for other in others])
            mine, theirs = members[index], members[list(others)]
            terms.append(log_of(mine * theirs / share) + uncertain)
            mine_plain, theirs_plain, plain_share = mine_plain - mine, theirs_plain - theirs, plain_share - share
        both_plain = np.maximum(mine_plain, 0.0) * np.maximum(theirs_plain, 0.0) / plain_share
        terms.append(log_of(both_plain) + plain)
        total: FloatArray = felt + np.logaddexp.reduce(np.array(terms))
        return total

    def _felt_factor(self, index: int, other: int) -> float:
        """Return the log Bayes factor of what was felt of the objects as a whole."""
        factor = 0.0
        for sense in self._memory.assumptions.object_senses:
            one, two = (self._graphs[each].measured.get(sense.name, Moments()) for each in (index, other))
            variance = sense.variance(graph.measured.get(sense.name, Moments()) for graph in self._graphs)
            factor += sense.log_evidence(one.plus(two), variance)
            factor -= sense.log_evidence(one, variance) + sense.log_evidence(two, variance)
        return factor

    def _plain_factor(self, index: int, other: int, parameters: ModelParameters) -> float:
        """Return the log Bayes factor of the plain model with this α and δ."""
        graph, known = self._graphs[index], self._graphs[other]
        fresh = AspectTransitionGraph(known.name, known.assumptions)
        given, alone = (log_evidence_of_counts(graph, start, parameters) for start in (known, fresh))
        return given - alone if alone > -math.inf else 0.0

    def _structure_factors(self, each: BelievedStructure, index: int, others: Sequence[int]) -> FloatArray:
        """Return the log Bayes factor of the raw trials under a structure, for each of the others."""
        learner, name = self._learner, self._memory.names[index]
        fresh = np.zeros((1, *each.contents.shape[1:]))
        contents = np.concatenate((each.contents[list(others)], fresh))
        total = np.zeros(len(contents))
        for trial, owner in zip(learner.trials, learner.owners, strict=True):
            if owner == name:
                alphabet = self._memory.assumptions.alphabet
                scores = score_trials(each.structure, [trial] * len(contents), learner.rates, alphabet, contents)
                total, contents = total + scores.log_evidence, scores.contents
        factors: FloatArray = total[:-1] - total[-1]
        return factors


class Passage(NamedTuple):
    """A transition between two patterns, by index, ``times`` times; or a first look at the target without the rest."""

    source: int | None
    action: int
    target: int
    times: int


def passages(graph: AspectTransitionGraph) -> Iterator[Passage]:
    """Yield what a graph counted in an order in which it may have been seen: each look is the first or follows another.

    The oldest aspect that nothing seen so far leads to counts as a first look.
    """
    patterns = graph.pattern_indices
    leaving: dict[int, list[tuple[int, int, int]]] = {}
    for (source, action, target), count in sorted(graph.counts.items()):
        leaving.setdefault(source, []).append((action, target, count))
    seen: set[int] = set()
    for first in range(graph.n_known):
        if first in seen:
            continue
        yield Passage(None, 0, patterns[first], 1)
        seen.add(first)
        waiting = [first]
        for aspect in waiting:  # grows while it is walked: breadth first
            for action, target, count in leaving.get(aspect, []):
                yield Passage(patterns[aspect], action, patterns[target], count)
                if target not in seen:
                    seen.add(target)
                    waiting.append(target)


def log_evidence_of_counts(
    graph: AspectTransitionGraph, known: AspectTransitionGraph, parameters: ModelParameters
) -> float:
    """Return ln p(what ``graph`` counted | it is the object of ``known``) of the plain model, learned as it goes.

    Args:
        graph: Its first looks and transitions are the evidence, in the order of ``passages``.
        known: What was known of the object before; it is not changed.
        parameters: α and δ.
    """
    learning = _LearningGraph(known, parameters)
    return sum(learning.take_in(passage) for passage in passages(graph))


class _LearningGraph:
    """An ATG by pattern that takes in passages and says how probable each was."""

    def __init__(self, graph: AspectTransitionGraph, parameters: ModelParameters) -> None:
        patterns = graph.pattern_indices
        self._parameters, self._assumptions = parameters, graph.assumptions
        self._known = set(patterns)
        self._counts: dict[tuple[int, int], dict[int, int]] = {}
        for (source, action, target), count in graph.counts.items():
            self._counts.setdefault((patterns[source], action), {})[patterns[target]] = count

    def take_in(self, passage: Passage) -> float:
        """Return ln p(passage), and learn from it; repeats of a transition are taken for seen rightly."""
        source, action, target, times = passage
        counts = {} if source is None else self._counts.get((source, action), {})
        alpha, delta = self._parameters.transition_concentration, self._parameters.observation_noise
        total, own, base = sum(counts.values()), counts.get(target, 0), self._base(target)
        led = base if total == 0 else (own + alpha * base) / (total + alpha)
        probability = (1.0 - delta) * led + delta / len(self._assumptions.alphabet)
        logarithm = math.log(probability) if probability > 0 else -math.inf
        if times > 1:
            # Π_{k=1}^{times − 1} (own + k) / (total + k), the Dirichlet posterior means one after the other
            logarithm += math.lgamma(own + times) - math.lgamma(own + 1)
            logarithm -= math.lgamma(total + times) - math.lgamma(total + 1)
        self._learn(source, action, target, times)
        return logarithm

    def _base(self, target: int) -> float:
        """Return the base probability of the aspect that shows a pattern, times that of the pattern."""
        n_aspects = self._assumptions.n_aspects
        if target in self._known:
            return 1.0 / n_aspects
        n_unobserved = n_aspects - len(self._known)
        return n_unobserved / n_aspects / max(len(self._assumptions.alphabet) - len(self._known), 1)

    def _learn(self, source: int | None, action: int, target: int, times: int) -> None:
        if len(self._known) < self._assumptions.n_aspects:
            self._known.add(target)
        if source in self._known and target in self._known and source is not None:
            counts = self._counts.setdefault((source, action), {})
            counts[target] = counts.get(target, 0) + times
