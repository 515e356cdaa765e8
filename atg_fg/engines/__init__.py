"""Inference engines by name. A new engine is one new file and one line here."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Mapping
from importlib import import_module
from typing import Any, Final

from atg_fg.core.belief import IdentityBelief
from atg_fg.core.checks import brief, instance
from atg_fg.core.errors import InvalidInputError, unknown_name
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.plugins import imported, loaded, registered
from atg_fg.engines.options import check_known
from atg_fg.inference.interface import Inference, TrialSetup

#: Entry points of other packages' engines.
GROUP: Final = "atg_fg.engines"


class Engines(Mapping[str, type[Inference]]):
    """Classes by name; one is imported when it is first asked for.

    Other packages register engines of their own by the entry point ``atg_fg.engines``; no name here is replaced.
    """

    def __init__(self, places: Mapping[str, str]) -> None:
        """Name the engines that are at ``places``, written ``module:class``; modules are those of this package."""
        self._places = dict(places)

    def __getitem__(self, name: str) -> type[Inference]:
        if name not in self._places:
            return _as_engine(loaded("engine", registered(GROUP)[name]), name)
        module, _, engine = self._places[name].partition(":")
        found: type[Inference] = getattr(import_module(f"{__name__}.{module}"), engine)
        return found

    def __contains__(self, name: object) -> bool:
        return name in self._places or name in registered(GROUP)

    def __iter__(self) -> Iterator[str]:
        return iter({**self._places, **registered(GROUP)})

    def __len__(self) -> int:
        return len({**self._places, **registered(GROUP)})


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


def engine_for(engine: str | type[Inference], parameters: ModelParameters | None = None) -> type[Inference]:
    """Return an engine's class.

    Args:
        engine: A name in ``ENGINES``; ``module:Class`` of a user's own, which is imported; or a class.
        parameters: Of the model that it is to know.

    Raises:
        UnknownNameError: No engine has this name.
        InvalidInputError: The user's own cannot be imported or is no engine; or the engine does not know of structures
            that objects share.
    """
    if isinstance(engine, str) and engine not in ENGINES and ":" not in engine:
        raise unknown_name("engine", engine, ENGINES)
    if not isinstance(engine, str):
        found = _as_engine(engine, brief(engine))
    else:
        found = ENGINES[engine] if engine in ENGINES else _as_engine(imported("engine", engine), engine)
    if parameters is not None and parameters.learn_structure and not found.knows_structure:
        able = ", ".join(name for name, each in ENGINES.items() if each.knows_structure)
        raise InvalidInputError(f"engine {engine!r}: does not know learn_structure; expected one of: {able}")
    return found


def _as_engine(found: Any, name: str) -> type[Inference]:
    if not (isinstance(found, type) and issubclass(found, Inference)):
        raise InvalidInputError(
            f"engine {name!r}: {brief(found)}; expected a subclass of atg_fg.inference.interface.Inference"
        )
    if inspect.isabstract(found):
        missing = ", ".join(sorted(found.__abstractmethods__))
        raise InvalidInputError(f"engine {name!r}: does not define {missing}; expected all that is abstract")
    return found


def begin_trial(
    engine: str | type[Inference],
    memory: RobotMemory,
    parameters: ModelParameters,
    prior: IdentityBelief | None = None,
    **options: Any,
) -> Inference:
    """Return the engine named ``engine`` at the beginning of a trial.

    Args:
        engine: A name in ``ENGINES``, ``module:Class`` of a user's own, or a class.
        memory: The robot memory when the trial begins; it is not changed.
        parameters: α, δ and whether to learn within the trial.
        prior: p(O) when the trial begins; the memory's if not given.
        **options: The engine's own keyword options; each has a default.

    Raises:
        UnknownNameError: No engine has this name.
        InvalidInputError: The engine does not know of structures that objects share, has no such option, or does not
            take this value; or the prior is not a distribution over the objects of this memory.
    """
    instance(memory, "memory", RobotMemory)
    instance(parameters, "parameters", ModelParameters)
    prior = None if prior is None else instance(prior, "prior", IdentityBelief)
    begin: Callable[..., Inference] = (found := engine_for(engine, parameters))
    check_known(found, found.name, options)
    inference = begin(TrialSetup(memory, parameters, prior), **options)
    inference.options = options
    inference._protect()
    return inference
