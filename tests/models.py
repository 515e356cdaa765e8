"""Small random models with a trial each, from a NumPy generator or from hypothesis, for ``atg_fg`` and the oracle."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, TypeAlias

import numpy as np
from hypothesis import strategies as st

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import ImpossibleEvidenceError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, PatternAlphabet
from atg_fg.engines import begin_trial
from atg_fg.inference.interface import Inference
from tests.oracle import Atg, Oracle

ALPHAS = (0.0, 1e-8, 0.1, 1.0, 5.0)
DELTAS = (0.0, 1e-8, 0.01, 0.3)
MAX_ASPECTS = 4

Pattern: TypeAlias = tuple[int, ...]
Pick: TypeAlias = Callable[[Sequence[Any]], Any]


@dataclass(frozen=True)
class Look:
    """A detection, or else soft evidence: the weight of every pattern in lexicographic order."""

    detection: tuple[int | None, ...] = ()
    weights: tuple[float, ...] | None = None

    @property
    def complete(self) -> Pattern | None:
        if self.weights is not None or None in self.detection:
            return None
        return tuple(symbol for symbol in self.detection if symbol is not None)

    def evidence(self, alphabet: PatternAlphabet) -> Evidence:
        if self.weights is not None:
            return Evidence.of_likelihood(alphabet, self.weights)
        return Evidence.of_detection(alphabet, self.detection)

    def likelihood(self, patterns: Sequence[Pattern]) -> dict[Pattern, Fraction]:
        if self.weights is not None:
            return {z: Fraction(weight) for z, weight in zip(patterns, self.weights, strict=True)}
        return {
            z: Fraction(all(seen in (None, shown) for seen, shown in zip(self.detection, z, strict=True)))
            for z in patterns
        }


@dataclass(frozen=True)
class Case:
    """Plain data of a model and of one trial: look, act, look, … and perhaps an action at the end."""

    n_slots: int
    n_symbols: int
    n_objects: int
    n_aspects: int
    n_actions: int
    graphs: tuple[Atg, ...]
    alpha: float
    delta: float
    learn_in_trial: bool
    looks: tuple[Look, ...]
    actions: tuple[int, ...]

    @property
    def patterns(self) -> list[Pattern]:
        return list(itertools.permutations(range(self.n_symbols), self.n_slots))

    @property
    def nothing(self) -> Look:
        return Look((None,) * self.n_slots)

    @property
    def assumptions(self) -> Assumptions:
        alphabet = PatternAlphabet(tuple(f"slot-{slot}" for slot in range(self.n_slots)), self.n_symbols)
        names = tuple(f"action-{action}" for action in range(self.n_actions))
        return Assumptions(self.n_objects, self.n_aspects, names, alphabet)

    @property
    def memory(self) -> RobotMemory:
        assumptions = self.assumptions
        return RobotMemory(assumptions, [graph_of(assumptions, f"graph-{i}", atg) for i, atg in enumerate(self.graphs)])

    @property
    def parameters(self) -> ModelParameters:
        return ModelParameters(self.alpha, self.delta, self.learn_in_trial)

    @property
    def oracle(self) -> Oracle:
        return Oracle(
            n_objects=self.n_objects,
            n_aspects=self.n_aspects,
            n_actions=self.n_actions,
            patterns=self.patterns,
            graphs=self.graphs,
            alpha=Fraction(str(self.alpha)),
            delta=Fraction(str(self.delta)),
            learn_in_trial=self.learn_in_trial,
        )

    def with_symbols(self, new: Sequence[int]) -> Case:
        """The same case with every symbol s called new[s]."""

        def rename(pattern: Sequence[int | None]) -> tuple[Any, ...]:
            return tuple(None if symbol is None else new[symbol] for symbol in pattern)

        def look(old: Look) -> Look:
            if old.weights is None:
                return Look(rename(old.detection))
            weight_of = {rename(z): weight for z, weight in zip(self.patterns, old.weights, strict=True)}
            return Look(weights=tuple(weight_of[z] for z in self.patterns))

        graphs = [
            Atg([rename(x) for x in atg.known], {(rename(x), a, rename(y)): n for (x, a, y), n in atg.counts.items()})
            for atg in self.graphs
        ]
        return replace(self, graphs=tuple(graphs), looks=tuple(map(look, self.looks)))

    def with_actions(self, new: Sequence[int]) -> Case:
        """The same case with every action a called new[a]."""
        graphs = [Atg(atg.known, {(x, new[a], y): n for (x, a, y), n in atg.counts.items()}) for atg in self.graphs]
        return replace(self, graphs=tuple(graphs), actions=tuple(new[a] for a in self.actions))


def gone_through(engine: str, case: Case) -> Inference:
    """An engine at the end of a case's trial; where a look is impossible, nothing is seen instead."""
    inference = begin_trial(engine, case.memory, case.parameters)
    alphabet = case.assumptions.alphabet
    for time, look in enumerate(case.looks):
        try:
            inference.observe(look.evidence(alphabet))
        except ImpossibleEvidenceError:
            inference.observe(case.nothing.evidence(alphabet))
        if time < len(case.actions):
            inference.act(case.actions[time])
    return inference


def graph_of(assumptions: Assumptions, name: str, atg: Atg) -> AspectTransitionGraph:
    graph = AspectTransitionGraph(name, assumptions)
    number = {pattern: graph.add_aspect(pattern) for pattern in atg.known}
    for (source, action, target), count in atg.counts.items():
        graph.add_transition(number[source], action, number[target], count)
    return graph


def random_case(rng: np.random.Generator) -> Case:
    return _case(lambda options: options[int(rng.integers(len(options)))])


@st.composite
def cases(draw: st.DrawFn) -> Case:
    return _case(lambda options: draw(st.sampled_from(options)))


def _case(pick: Pick) -> Case:
    n_slots = pick((1, 2, 3))
    n_symbols = pick({1: (1, 2, 3, 5), 2: (2, 3, 4), 3: (3, 4)}[n_slots])
    patterns = list(itertools.permutations(range(n_symbols), n_slots))
    n_aspects = pick(range(1, min(len(patterns), MAX_ASPECTS) + 1))
    n_actions = pick((1, 2, 3))
    graphs = tuple(_atg(pick, patterns, n_aspects, n_actions) for _ in range(pick(range(5))))
    # Few patterns come up in a trial, so that they come up again.
    pool = [pattern for atg in graphs for pattern in atg.known] + [pick(patterns)]
    n_looks = pick((2, 3, 4))
    return Case(
        n_slots=n_slots,
        n_symbols=n_symbols,
        n_objects=pick((1, 2, 3, 6, 100)),
        n_aspects=n_aspects,
        n_actions=n_actions,
        graphs=graphs,
        alpha=pick((0.0, *ALPHAS)),
        delta=pick((0.0, *DELTAS)),
        learn_in_trial=pick((False, True)),
        looks=tuple(_look(pick, patterns, pool) for _ in range(n_looks)),
        actions=tuple(pick(range(n_actions)) for _ in range(n_looks - pick((0, 1)))),
    )


def _atg(pick: Pick, patterns: list[Pattern], n_aspects: int, n_actions: int) -> Atg:
    n_known = pick((0, n_aspects, *range(n_aspects + 1)))
    known: list[Pattern] = []
    while len(known) < n_known:
        known.append(pick([pattern for pattern in patterns if pattern not in known]))
    counts: dict[tuple[Pattern, int, Pattern], int] = {}
    for source, action in itertools.product(known, range(n_actions)):
        for _ in range(pick((0, 1, 2))):
            counts[source, action, pick(known)] = pick((1, 2, 7))
    return Atg(known, counts)


def _look(pick: Pick, patterns: list[Pattern], pool: list[Pattern]) -> Look:
    kind = pick(("complete", "complete", "complete", "partial", "nothing", "soft"))
    pattern = pick(pool if pick((True, True, False)) else patterns)
    if kind == "complete":
        return Look(pattern)
    if kind == "partial":
        return Look(tuple(pick((None, symbol)) for symbol in pattern))
    if kind == "nothing":
        return Look((None,) * len(pattern))
    weights = [pick((0.0, 0.125, 0.5, 1.0, 3.0)) for _ in patterns]
    weights[patterns.index(pattern)] = 2.0
    return Look(weights=tuple(weights))
