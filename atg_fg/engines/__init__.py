"""Inference engines by name. A new engine is one new file and one line here."""

from __future__ import annotations

from typing import Final

from atg_fg.engines.base import Inference
from atg_fg.engines.bayes_filter import BayesFilter
from atg_fg.engines.enumeration import Enumeration
from atg_fg.engines.gtsam_elimination import GtsamElimination
from atg_fg.errors import unknown_name
from atg_fg.memory import RobotMemory
from atg_fg.parameters import ModelParameters

ENGINES: Final[dict[str, type[Inference]]] = {
    engine.name: engine for engine in (GtsamElimination, BayesFilter, Enumeration)
}


def begin_trial(engine: str, memory: RobotMemory, parameters: ModelParameters) -> Inference:
    """Return the engine named ``engine`` at the beginning of a trial.

    Raises:
        UnknownNameError: No engine has this name.
    """
    if engine not in ENGINES:
        raise unknown_name("engine", engine, ENGINES)
    return ENGINES[engine](memory, parameters)
