"""Inference engines by name. A new engine is one new file and one line here."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

from atg_fg.core.belief import IdentityBelief
from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.engines.bayes_filter import BayesFilter
from atg_fg.engines.enumeration import Enumeration
from atg_fg.engines.gibbs_sampling import GibbsSampling
from atg_fg.engines.gtsam_elimination import GtsamElimination
from atg_fg.engines.gtsam_routes import GtsamMarginals, GtsamMultifrontal, GtsamSequential
from atg_fg.engines.large_memory.engine import LargeMemory
from atg_fg.engines.learned_structure import LearnedStructure
from atg_fg.engines.loopy_belief_propagation import LoopyBeliefPropagation
from atg_fg.engines.mean_field import MeanField
from atg_fg.engines.options import check_known
from atg_fg.engines.particle_filter import ParticleFilter
from atg_fg.inference.interface import Inference

ENGINES: Final[dict[str, type[Inference]]] = {
    engine.name: engine
    for engine in (
        GtsamElimination,
        BayesFilter,
        Enumeration,
        GtsamSequential,
        GtsamMultifrontal,
        GtsamMarginals,
        LoopyBeliefPropagation,
        ParticleFilter,
        GibbsSampling,
        MeanField,
        LearnedStructure,
        LargeMemory,
    )
}


def check_engine(engine: str, parameters: ModelParameters) -> None:
    """Check that there is an engine of this name, and that it knows the model that these parameters mean.

    Raises:
        UnknownNameError: No engine has this name.
        InvalidInputError: The engine does not know of structures that objects share.
    """
    if engine not in ENGINES:
        raise unknown_name("engine", engine, ENGINES)
    if parameters.learn_structure and not ENGINES[engine].knows_structure:
        able = ", ".join(name for name, each in ENGINES.items() if each.knows_structure)
        raise InvalidInputError(f"engine {engine!r}: does not know learn_structure; expected one of: {able}")


def begin_trial(
    engine: str,
    memory: RobotMemory,
    parameters: ModelParameters,
    prior: IdentityBelief | None = None,
    **options: Any,
) -> Inference:
    """Return the engine named ``engine`` at the beginning of a trial.

    Args:
        engine: A name in ``ENGINES``.
        memory: The robot memory when the trial begins; it is not changed.
        parameters: α, δ and whether to learn within the trial.
        prior: p(O) when the trial begins; the memory's if not given.
        **options: The engine's own keyword options; each has a default.

    Raises:
        UnknownNameError: No engine has this name.
        InvalidInputError: The engine does not know of structures that objects share, has no such option, or does not
            take this value; or the prior is not a distribution over the objects of this memory.
    """
    check_engine(engine, parameters)
    check_known(ENGINES[engine], engine, options)
    begin: Callable[..., Inference] = ENGINES[engine]
    inference = begin(memory, parameters, prior, **options)
    inference.options = options
    return inference
