"""Inference engines by name. A new engine is one new file and one line here."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from typing import Any, Final

from atg_fg.core.belief import IdentityBelief
from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.engines.options import check_known
from atg_fg.inference.interface import Inference, TrialSetup


class Engines(Mapping[str, type[Inference]]):
    """Classes by name; one is imported when it is first asked for."""

    def __init__(self, places: Mapping[str, str]) -> None:
        """Name the engines that are at ``places``, written ``module:class``; modules are those of this package."""
        self._places = dict(places)

    def __getitem__(self, name: str) -> type[Inference]:
        module, _, engine = self._places[name].partition(":")
        found: type[Inference] = getattr(import_module(f"{__name__}.{module}"), engine)
        return found

    def __contains__(self, name: object) -> bool:
        return name in self._places

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def __len__(self) -> int:
        return len(self._places)


#: Classes of engines by the names that ``begin_trial`` and ``--engine`` take.
ENGINES: Final = Engines(
    {
        "gtsam": "gtsam_elimination:GtsamElimination",
        "bayes-filter": "bayes_filter:BayesFilter",
        "enumeration": "enumeration:Enumeration",
        "gtsam-sequential": "gtsam_routes:GtsamSequential",
        "gtsam-multifrontal": "gtsam_routes:GtsamMultifrontal",
        "gtsam-marginals": "gtsam_routes:GtsamMarginals",
        "loopy-bp": "loopy_belief_propagation:LoopyBeliefPropagation",
        "particle": "particle_filter:ParticleFilter",
        "gibbs": "gibbs_sampling:GibbsSampling",
        "mean-field": "mean_field:MeanField",
        "learned-structure": "learned_structure:LearnedStructure",
        "large-memory": "large_memory.engine:LargeMemory",
    }
)


def usual_engine(parameters: ModelParameters, usual: str) -> str:
    """Return the name of the ``usual`` engine, or of the one that the parameters need."""
    return "learned-structure" if parameters.learn_structure else usual


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
    inference = begin(TrialSetup(memory, parameters, prior), **options)
    inference.options = options
    inference._protect()
    return inference
