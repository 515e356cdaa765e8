"""Whether an engine is one: what ``check_env`` is to gymnasium's environments, for engines of a user's own."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from copy import copy
from functools import partial
from typing import Any, Final, NamedTuple

import numpy as np

from atg_fg.core.actions import NOTHING, AnyAction, UncertainAction
from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.errors import ImpossibleEvidenceError, InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, FloatArray, PatternAlphabet
from atg_fg.core.promises import require
from atg_fg.engines import begin_trial, engine_for
from atg_fg.inference.interface import Inference

#: How far an exact engine may be from enumeration, in probabilities, nats and logarithms.
TOLERANCE: Final = 1e-9
_PARAMETERS: Final = (
    ModelParameters(1e-8, 1e-8, learn_in_trial=False),
    ModelParameters(0.5, 0.05, learn_in_trial=False),
    ModelParameters(0.5, 0.05, learn_in_trial=True),
    ModelParameters(1.0, 0.0, learn_in_trial=True),
)


class _Case(NamedTuple):
    """A small model with a trial: a look, an action, a look and so on."""

    number: int
    memory: RobotMemory
    parameters: ModelParameters
    prior: IdentityBelief | None
    looks: list[Evidence]
    actions: list[AnyAction]


class Deviation(NamedTuple):
    """How far an engine was from enumeration in all trials of a check.

    Attributes:
        identity: The greatest ½ Σ |p(O) − q(O)|.
        log_evidence: The greatest |Δ ln p(z_0:t | a_1:t)|; 0 of engines that say they are approximate.
        expected_entropy: The greatest |Δ E[H(O | z, a)]|, nats.
        smoothed: The greatest |Δ p(X_s | O, all evidence)|.
        looks: Looks that were compared.
    """

    identity: float = 0.0
    log_evidence: float = 0.0
    expected_entropy: float = 0.0
    smoothed: float = 0.0
    looks: int = 0


def check_engine(
    engine: str | type[Inference], *, cases: int = 40, seed: int = 0, tolerance: float = TOLERANCE, **options: Any
) -> Deviation:
    """Raise ``AssertionError`` if an engine is not what ``Inference`` promises; return how far it is from exact.

    Small random models, with and without learning in the trial, noise and a prior of their own, are gone through look
    by look beside ``enumeration``. An engine that says it is exact must give the same numbers; one that does not must
    give distributions, and keep the bound that it states, if it states one. Besides: what makes no sense is refused and
    changes nothing; the same trial gives the same numbers; copies and pickles share nothing; arrays are read-only.

    Args:
        engine: A class, a name in ``ENGINES``, or ``module:Class``.
        cases: Random models.
        seed: Of the models.
        tolerance: How far an exact engine may be from enumeration.
        **options: The engine's own.

    Raises:
        AssertionError: The engine breaks a promise; the message says which, in which case, and after which look.
        InvalidInputError: It is no engine at all.
    """
    found = engine_for(engine)
    for attribute, kind in (("name", str), ("exact", bool), ("knows_structure", bool)):
        value = getattr(found, attribute, None)
        require(isinstance(value, kind), f"{attribute} is {value!r}; expected a {kind.__name__}")
    worst = Deviation()
    for number in range(cases):
        case = _drawn_case(number, np.random.default_rng((seed, number)), sure=not found.takes_uncertain_actions)
        begin = partial(begin_trial, found, case.memory, case.parameters, case.prior, **options)
        worst = _compared(found, begin, case, tolerance, worst)
        _check_refusals(begin(), case)
        _check_copies(begin, case)
    return worst


def _compared(
    engine: type[Inference], begin: Callable[[], Inference], case: _Case, tolerance: float, worst: Deviation
) -> Deviation:
    """Go through a trial beside enumeration, and return the greatest deviations so far."""
    tried, again = begin(), begin()
    exact = begin_trial("enumeration", case.memory, case.parameters, case.prior)
    for look, evidence in enumerate(case.looks):
        place = f"case {case.number}, after look {look}"
        for inference in (tried, again, exact):
            inference.observe(evidence)
        numbers = _answers(tried)
        require(_same(numbers, _answers(again)), f"{place}: the same trial gave other numbers; expected the same")
        deviation = _deviation(numbers, _answers(exact))
        _check_distributions(tried, place)
        if engine.exact:
            for name, value in deviation.items():
                require(value <= tolerance, f"{place}: {name} is off by {value:.3g}; expected at most {tolerance:g}")
        bound = tried.total_variation_bound
        if bound is not None:
            off = deviation["identity"]
            require(off <= bound + tolerance, f"{place}: identity is off by {off:.3g}; its bound is {bound:.3g}")
        logs = deviation["log_evidence"] if engine.exact else 0.0
        worst = Deviation(
            max(worst.identity, deviation["identity"]),
            max(worst.log_evidence, logs),
            max(worst.expected_entropy, deviation["expected_entropy"]),
            max(worst.smoothed, deviation["smoothed"]),
            worst.looks + 1,
        )
        if look < len(case.actions):
            for inference in (tried, again, exact):
                inference.act(case.actions[look])
    return worst


def _answers(inference: Inference) -> dict[str, FloatArray]:
    """Return all that is compared, as arrays by name."""
    belief = inference.identity()
    hypothesis = belief.most_probable_hypothesis
    return {
        "identity": np.append(belief.objects, belief.unseen),
        "log_evidence": np.array([inference.log_evidence]),
        "expected_entropy": np.asarray(inference.expected_entropies()),
        "smoothed": np.concatenate(inference.smoothed_aspects(hypothesis)),
    }


def _same(one: dict[str, FloatArray], other: dict[str, FloatArray]) -> bool:
    return all(np.array_equal(one[name], other[name]) for name in one)


def _deviation(numbers: dict[str, FloatArray], exact: dict[str, FloatArray]) -> dict[str, float]:
    result = {}
    for name, found in numbers.items():
        # Smoothing is of the object that is most probable to each: of an approximate engine that may be another.
        comparable = found.shape == exact[name].shape
        result[name] = float(np.abs(found - exact[name]).max(initial=0.0)) if comparable else np.inf
    result["identity"] = float(np.abs(numbers["identity"] - exact["identity"]).sum()) / 2
    return result


def _check_distributions(inference: Inference, place: str) -> None:
    belief = inference.identity()
    given = np.append(belief.objects, belief.unseen)
    require(
        given.shape == (inference.model.n_hypotheses,),
        f"{place}: identity of shape {given.shape}; expected {inference.model.n_hypotheses} hypotheses",
    )
    smoothed = inference.smoothed_aspects(belief.most_probable_hypothesis)
    require(
        len(smoothed) == len(inference.history.evidence),
        f"{place}: smoothed aspects of {len(smoothed)} times; expected {len(inference.history.evidence)}",
    )
    for what, values in (("identity", given), *(("smoothed aspects", each) for each in smoothed)):
        sound = bool((values >= 0).all()) and abs(float(values.sum()) - 1.0) < 1e-6
        require(sound, f"{place}: {what} {values}; expected a distribution")
    entropies = inference.expected_entropies()
    require(
        entropies.shape == (inference.model.n_actions,) and bool((entropies >= -1e-9).all()),
        f"{place}: expected entropies {entropies}; expected one of at least 0 for each action",
    )
    for name, value in vars(inference).items():
        if isinstance(value, np.ndarray) and not name.startswith("_"):
            require(not value.flags.writeable, f"{place}: {name} can be written to; expected a read-only array")


def _check_refusals(inference: Inference, case: _Case) -> None:
    """Check that what makes no sense is refused, and that nothing has changed after it."""
    place = f"case {case.number}"
    _refused(lambda: inference.act(0), f"{place}: an action before the first look")
    _refused(inference.expected_entropies, f"{place}: expected entropies before the first look")
    inference.observe(case.looks[0])
    before = _answers(inference)
    _refused(lambda: inference.act(inference.model.n_actions), f"{place}: an action that there is not")
    _refused(lambda: inference.act(-1), f"{place}: action -1")
    inference.act(0)
    _refused(inference.expected_entropies, f"{place}: expected entropies between an action and its look")
    nothing = Evidence(np.zeros(inference.model.n_patterns))
    _refused(lambda: inference.observe(nothing), f"{place}: a look that no object could give", ImpossibleEvidenceError)
    require(len(before["identity"]) == inference.model.n_hypotheses, f"{place}: hypotheses have come or gone")
    inference.observe(Evidence(np.ones(inference.model.n_patterns)))
    _check_distributions(inference, f"{place}, after a look that was refused and one that says nothing")


def _check_copies(begin: Callable[[], Inference], case: _Case) -> None:
    """Check that a copy goes its own way, and that a pickled engine goes on as the engine would have."""
    place, inference = f"case {case.number}", begin()
    inference.observe(case.looks[0])
    before, twin = _answers(inference), copy(inference)
    stored = pickle.loads(pickle.dumps(inference))
    for other in (twin, stored):
        other.act(0)
        other.observe(case.looks[-1])
    require(_same(before, _answers(inference)), f"{place}: what was done to a copy has changed the engine")
    require(_same(_answers(twin), _answers(stored)), f"{place}: a pickled engine goes on otherwise than a copy")


def _refused(ask: Callable[[], object], what: str, error: type[Exception] = InvalidInputError) -> None:
    try:
        ask()
    except error:
        return
    except Exception as other:
        raise AssertionError(f"{what} raised {type(other).__name__}: {other}; expected {error.__name__}") from other
    raise AssertionError(f"{what} was taken; expected {error.__name__}")


def _drawn_case(number: int, rng: np.random.Generator, *, sure: bool) -> _Case:
    """Return a model of one slot or two with up to four objects, and a trial of three looks.

    In some trials looks follow each other without an action, or it is not sure what was done, unless ``sure``.
    """
    parameters = _PARAMETERS[number % len(_PARAMETERS)]
    slots = ("front", "top")[: int(rng.integers(1, 3))]
    alphabet = PatternAlphabet(slots, int(rng.integers(2, 5)))
    n_aspects = int(rng.integers(1, min(len(alphabet), 4) + 1))
    assumptions = Assumptions(6, n_aspects, ("turn", "tip")[: int(rng.integers(1, 3))], alphabet)
    graphs = [_drawn_graph(f"object-{index}", assumptions, rng) for index in range(int(rng.integers(1, 5)))]
    memory = RobotMemory(assumptions, graphs)
    prior = None
    if number % 3 == 2:
        weights = rng.dirichlet(np.ones(len(graphs) + 1))
        prior = IdentityBelief.of(weights, assumptions.n_objects - len(graphs))
    looks, actions = _drawn_trial(memory, parameters, rng, sure=sure)
    return _Case(number, memory, parameters, prior, looks, actions)


def _drawn_graph(name: str, assumptions: Assumptions, rng: np.random.Generator) -> AspectTransitionGraph:
    graph = AspectTransitionGraph(name, assumptions)
    n_known = int(rng.integers(0, assumptions.n_aspects + 1))
    for pattern in rng.permutation(len(assumptions.alphabet))[:n_known].tolist():
        graph.add_aspect(tuple(assumptions.alphabet.symbols[pattern].tolist()))
    for _ in range(3 * n_known):
        source, target = rng.integers(n_known, size=2).tolist()
        graph.add_transition(source, int(rng.integers(len(assumptions.actions))), target, int(rng.integers(1, 4)))
    return graph


def _drawn_trial(
    memory: RobotMemory, parameters: ModelParameters, rng: np.random.Generator, *, sure: bool
) -> tuple[list[Evidence], list[AnyAction]]:
    """Return looks that are possible, whole, in part or soft, with random actions between them."""
    n_patterns, looks = len(memory.assumptions.alphabet), 3
    actions = [_drawn_action(memory.assumptions, rng, sure=sure) for _ in range(looks - 1)]
    guide, evidence = begin_trial("enumeration", memory, parameters), []
    for look in range(looks):
        likelihood = np.zeros(n_patterns)
        kind = rng.integers(3)
        likelihood[int(rng.integers(n_patterns))] = 1.0
        if kind == 1:
            likelihood = np.maximum(likelihood, rng.integers(2, size=n_patterns))
        elif kind == 2:
            likelihood = rng.uniform(0.01, 1.0, n_patterns)
        whole = int(likelihood.argmax()) if kind == 0 else None
        try:
            given = Evidence(likelihood, whole)
            guide.observe(given)
        except ImpossibleEvidenceError:
            given = Evidence(np.ones(n_patterns))
            guide.observe(given)
        evidence.append(given)
        if look < len(actions):
            guide.act(actions[look])
    return evidence, actions


def _drawn_action(assumptions: Assumptions, rng: np.random.Generator, *, sure: bool) -> AnyAction:
    index, kind = int(rng.integers(len(assumptions.actions))), rng.integers(4)
    if kind == 2:
        return NOTHING
    if kind == 3 and not sure:
        shares = rng.dirichlet(np.ones(len(assumptions.actions) + 1)).tolist()
        return UncertainAction(tuple(enumerate(shares[:-1])), shares[-1])
    return index
