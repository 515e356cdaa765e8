"""What the model of looks that err has found, and warnings that name an assumption which does not seem to hold."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from atg_fg.core.memory import RobotMemory
from atg_fg.learning.structured_memory import StructuredMemory

#: Nats by which labels drawn at random have to explain a trial better than the model does, for a warning.
WORSE_THAN_CHANCE: Final = 5.0


def summary_of_evidence(memory: StructuredMemory) -> dict[str, Any]:
    """Return what was sampled as JSON knows it: noise, structure, events; empty if the other model has all the say.

    ``weight`` is that of the model in which looks err; ``wrong`` and ``slip`` are rates; ``states`` and ``registers``
    are those of the best chain, and ``own_automata`` how many objects have one of their own.
    """
    log_weight, _ = memory.log_erring_weights
    chains = memory.evidence.best() if memory.learner.trials and log_weight > -np.inf else None
    if chains is None:
        return {}
    return {
        "weight": float(np.exp(log_weight)),
        "wrong": memory.evidence.noise.wrong,
        "slip": chains.slip,
        "states": chains.n_states,
        "registers": int(chains.clusters.tables.shape[1]),
        "own_automata": len(chains.own_automata),
        "objects": int(np.count_nonzero(chains.clusters.n_trials)),
        "reassignments": len(memory.reassignments),
        "warnings": predictive_checks(memory),
    }


def predictive_checks(memory: StructuredMemory) -> list[str]:
    """Return a warning for each assumption that what was seen speaks against.

    More ATGs than objects; trials that the model, each taken for one of a fresh object, explains worse than chance.
    """
    return too_many_graphs(memory) + [
        f"trial {number} is less probable than labels drawn at random: its object is moved otherwise than all others "
        "(actions), or the detector erred more than usual (noise)"
        for number in np.flatnonzero(memory.evidence.log_gain_over_chance() < -WORSE_THAN_CHANCE).tolist()
    ]


def too_many_graphs(memory: RobotMemory) -> list[str]:
    """Return a warning if there are more ATGs than objects."""
    n_objects = memory.assumptions.n_objects
    if len(memory) <= n_objects:
        return []
    return [f"{len(memory)} ATGs, but n_objects is {n_objects}: there are more objects, or one has several ATGs"]
