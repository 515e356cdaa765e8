"""``docs/model.md`` written out in exact fractions and plain loops, to be read beside that page.

Nothing is imported from ``atg_fg``. An aspect is named by its pattern, since the aspects of one object are unique.
What is believed is the joint weight p(o, x_0, …, x_t, z_0:t | a_1:t) of every single explanation; all else is a sum.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction

COLLECTION = "C"

Pattern = tuple[int, ...]
State = Pattern | str
Explanation = tuple[int, tuple[State, ...]]  # (i, (x_0, …, x_t))


@dataclass
class Atg:
    """One hypothesis: its known aspects, and c(x, a, y)."""

    known: list[Pattern] = field(default_factory=list)
    counts: dict[tuple[Pattern, int, Pattern], int] = field(default_factory=dict)


class ImpossibleError(Exception):
    """Evidence of probability zero."""


class Oracle:
    """One trial. Hypotheses are 0 … K-1, the remembered objects, and K, *unseen*."""

    def __init__(
        self,
        *,
        n_objects: int,
        n_aspects: int,
        n_actions: int,
        patterns: Sequence[Pattern],
        graphs: Iterable[Atg],
        alpha: Fraction,
        delta: Fraction,
        learn_in_trial: bool,
    ) -> None:
        self.G, self.Z, self.n_actions = n_aspects, list(patterns), n_actions
        self.alpha, self.delta, self.learn_in_trial = alpha, delta, learn_in_trial
        remembered = [Atg(list(graph.known), dict(graph.counts)) for graph in graphs]
        self.K = len(remembered)
        self.U = max(n_objects - self.K, 1)
        self.atgs = [*remembered, Atg()]
        self.last_pattern: Pattern | None = None
        self.last_action: int | None = None
        self.weights: dict[Explanation, Fraction] = {
            (i, (x,)): self.prior(i) * self.base(i, x) for i in range(self.K + 1) for x in self.states(i)
        }

    # The generative model

    def prior(self, i: int) -> Fraction:
        """1/N each and U/N for unseen, normalised: N cancels."""
        return Fraction(self.U if i == self.K else 1, self.K + self.U)

    def unobserved(self, i: int) -> int:
        """m_i = G − n_i."""
        return self.G - len(self.atgs[i].known)

    def states(self, i: int) -> list[State]:
        """The collection node, absent when m_i = 0, and the known aspects."""
        return [*([COLLECTION] if self.unobserved(i) > 0 else []), *self.atgs[i].known]

    def base(self, i: int, y: State) -> Fraction:
        """1/G for a known aspect, m_i/G for C_i. This is p(X_0 | O = i) as well."""
        return Fraction(self.unobserved(i) if y == COLLECTION else 1, self.G)

    def transition(self, i: int, x: State, a: int, y: State) -> Fraction:
        """p(y | x, a, i)."""
        total = sum(n for (source, action, _), n in self.atgs[i].counts.items() if (source, action) == (x, a))
        if x == COLLECTION or total == 0:
            return self.base(i, y)
        return (self.atgs[i].counts.get((x, a, y), 0) + self.alpha * self.base(i, y)) / (total + self.alpha)

    def observation(self, i: int, x: State, z: Pattern) -> Fraction:
        """p(z | x, i)."""
        known = self.atgs[i].known
        if x != COLLECTION:
            shown = Fraction(z == x)
        elif z in known:
            shown = Fraction(0)
        else:
            shown = Fraction(1, len(self.Z) - len(known))
        return (1 - self.delta) * shown + self.delta / len(self.Z)

    # The trial

    def observe(self, evidence: dict[Pattern, Fraction], complete: Pattern | None) -> None:
        """Evidence z_t as a likelihood of every pattern, and its pattern if it was complete."""
        rates: dict[tuple[int, State], Fraction] = {
            (i, x): sum((evidence[z] * self.observation(i, x, z) for z in self.Z), Fraction(0))
            for i in range(self.K + 1)
            for x in self.states(i)
        }
        weights = {(i, xs): weight * rates[i, xs[-1]] for (i, xs), weight in self.weights.items()}
        weights = {explanation: weight for explanation, weight in weights.items() if weight > 0}
        if not weights:
            raise ImpossibleError
        self.weights = weights  # 1.
        if self.learn_in_trial and complete is not None:
            for i in range(self.K + 1):
                self._new_node(i, complete)  # 2.
                self._count(i, complete)  # 3.
        self.last_pattern = complete

    def act(self, a: int) -> None:
        """Every explanation goes on to every next aspect."""
        weights: dict[Explanation, Fraction] = {}
        for (i, xs), weight in self.weights.items():
            for y in self.states(i):
                probability = self.transition(i, xs[-1], a, y)
                if probability > 0:
                    weights[i, (*xs, y)] = weight * probability
        self.weights = weights
        self.last_action = a

    def _new_node(self, i: int, z: Pattern) -> None:
        atg = self.atgs[i]
        n = len(atg.known)
        if z in atg.known or n >= self.G:
            return
        to_node = (1 - self.delta) / (len(self.Z) - n)
        to_collection = self.delta / len(self.Z)
        if n + 1 == self.G:
            to_node, to_collection = Fraction(1), Fraction(0)
        atg.known.append(z)
        for explanation in [(o, xs) for o, xs in self.weights if o == i and xs[-1] == COLLECTION]:
            weight = self.weights.pop(explanation)
            past = explanation[1][:-1]
            for state, share in ((z, to_node), (COLLECTION, to_collection)):
                if share > 0:
                    self.weights[i, (*past, state)] = weight * share / (to_node + to_collection)

    def _count(self, i: int, z: Pattern) -> None:
        if self.last_action is None or self.last_pattern is None:
            return
        atg = self.atgs[i]
        if self.last_pattern in atg.known and z in atg.known:
            edge = (self.last_pattern, self.last_action, z)
            atg.counts[edge] = atg.counts.get(edge, 0) + 1

    # What is inferred

    def identity(self) -> list[Fraction]:
        """p(O = i | z, a) of each remembered object, then of unseen."""
        return self._normalised((i, weight) for (i, _), weight in self.weights.items())

    def entropy(self) -> float:
        """H(O), nats."""
        return self._entropy_of(self.identity())

    def expected_entropy(self, a: int) -> float:
        """Σ_z p(z | a) · H(O | z, a) over all patterns."""
        belief: defaultdict[tuple[int, State], Fraction] = defaultdict(Fraction)
        for (i, xs), weight in self.weights.items():
            belief[i, xs[-1]] += weight
        predicted: defaultdict[tuple[int, State], Fraction] = defaultdict(Fraction)
        for (i, x), weight in belief.items():
            for y in self.states(i):
                predicted[i, y] += weight * self.transition(i, x, a, y)
        total = sum(belief.values())
        expected = 0.0
        for z in self.Z:
            joint = [(i, weight * self.observation(i, y, z)) for (i, y), weight in predicted.items()]
            p_z = sum(weight for _, weight in joint) / total
            if p_z > 0:
                expected += float(p_z) * self._entropy_of(self._normalised(joint))
        return expected

    def log_evidence(self) -> float:
        """ln p(z_0:t | a_1:t)."""
        return math.log(sum(self.weights.values()))

    def smoothed(self, i: int) -> list[dict[State, Fraction]] | None:
        """p(X_s | O = i, z_0:t, a_1:t) of every time s; ``None`` if the object is ruled out."""
        explanations = {xs: weight for (o, xs), weight in self.weights.items() if o == i}
        if not explanations:
            return None
        total = sum(explanations.values())
        times: list[dict[State, Fraction]] = [defaultdict(Fraction) for _ in next(iter(explanations))]
        for xs, weight in explanations.items():
            for time, x in enumerate(xs):
                times[time][x] += weight / total
        return [dict(distribution) for distribution in times]

    def state_number(self, i: int, x: State) -> int:
        """0 for the collection node, 1 + k for the k-th known aspect."""
        return 0 if x == COLLECTION else 1 + self.atgs[i].known.index(x)

    def _normalised(self, weights: Iterable[tuple[int, Fraction]]) -> list[Fraction]:
        sums = [Fraction(0)] * (self.K + 1)
        for i, weight in weights:
            sums[i] += weight
        total = sum(sums)
        return [weight / total for weight in sums]

    def _entropy_of(self, probabilities: Sequence[Fraction]) -> float:
        terms = [float(p) * math.log(p) for p in probabilities[:-1] if p > 0]
        unseen = probabilities[-1]
        if unseen > 0:
            terms.append(float(unseen) * math.log(unseen / self.U))
        return -sum(terms)
