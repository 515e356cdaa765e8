"""The small worlds that tests by hand are about."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import pytest

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import Evidence, PatternAlphabet
from atg_fg.engines import ENGINES, begin_trial
from atg_fg.inference.interface import Inference

EXACT_ENGINES = [name for name, engine in ENGINES.items() if engine.exact]
APPROXIMATE_ENGINES = [name for name, engine in ENGINES.items() if not engine.exact]
#: Engines that make the whole graph anew at each question, and differ in how GTSAM eliminates it.
ROUTES = [name for name in EXACT_ENGINES if name.startswith("gtsam-")]


def each_of(engines: Iterable[str]) -> pytest.MarkDecorator:
    """Run a test with each of these engines; but for the first route, routes are left to the slow tests.

    ``engines/test_agreement.py`` holds all of them to the truth in any case.
    """
    marks = dict.fromkeys(ROUTES[1:], pytest.mark.slow)
    return pytest.mark.parametrize("engine", [pytest.param(each, marks=marks.get(each, ())) for each in engines])


every_exact_engine = each_of(EXACT_ENGINES)


def one_slot(n_objects: int, n_aspects: int, n_symbols: int, actions: tuple[str, ...] = ("push",)) -> Assumptions:
    """Aspects that show one symbol each, so that a pattern and its index are the same number."""
    return Assumptions(n_objects, n_aspects, actions, PatternAlphabet(("front",), n_symbols))


def graph(
    assumptions: Assumptions, name: str, aspects: list[tuple[int, ...]], *edges: tuple[int, int, int, int]
) -> AspectTransitionGraph:
    """A graph with these aspects and (source, action, target, count) edges."""
    result = AspectTransitionGraph(name, assumptions)
    for pattern in aspects:
        result.add_aspect(pattern)
    for edge in edges:
        result.add_transition(*edge)
    return result


def seen(assumptions: Assumptions, *symbols: int | None) -> Evidence:
    return Evidence.of_detection(assumptions.alphabet, symbols)


def trial(
    engine: str,
    memory: RobotMemory,
    parameters: ModelParameters,
    *steps: int,
    options: Mapping[str, Any] | None = None,
) -> Inference:
    """A trial in a world of one slot: symbol, action, symbol, action, …"""
    inference = begin_trial(engine, memory, parameters, **(options or {}))
    for number, step in enumerate(steps):
        if number % 2:
            inference.act(step)
        else:
            inference.observe(seen(memory.assumptions, step))
    return inference
