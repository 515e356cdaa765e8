"""The least that a decision can cost: what has to be read, and the logarithms that have to be taken.

For one object and one action p(O, z | a) takes one value for all patterns that the object does not know, one for those
it knows but no counted edge leads to, and another for each target of an edge (``docs/performance.md``). So the belief,
the counted edges and the rows that have any are read once, and there is one logarithm for each of these values and for
each entry of p(z | a).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from atg_fg.core.memory import RobotMemory
from atg_fg.inference.recognition_model import RecognitionModel
from atg_fg.storage.presets import preset
from benchmarks.machine import rates
from benchmarks.measuring import Clock

#: A probability, and where it comes from and goes to in four bytes each.
EDGE_BYTES = 16


def counts(memory: RobotMemory) -> dict[str, int]:
    """Return the bytes and the logarithms of a decision without learning in the trial."""
    model = RecognitionModel(memory, preset("paper"))
    edges = model.edges
    targets = np.stack((edges.action, edges.hypothesis, edges.target))
    rows = np.stack((edges.action, edges.hypothesis, edges.source))
    n_states = int((model.n_known + 1).sum())
    return {
        "bytes": 8 * n_states + 8 * _n_distinct(rows) + EDGE_BYTES * len(edges.action),
        "logarithms": _n_distinct(targets) + model.n_actions * (2 * model.n_hypotheses + model.n_patterns),
    }


def _n_distinct(columns: Any) -> int:
    return int(np.unique(columns, axis=1).shape[1]) if columns.shape[1] else 0


def floor(memory: RobotMemory, n_rounds: int, clock: Clock) -> dict[str, Any]:
    """Return counts, this machine's rates, and the milliseconds that follow from them.

    Reading and logarithms may go on at the same time, so the floor is the longer of both.
    """
    needed = counts(memory)
    measured = rates(needed["bytes"], n_rounds, clock)
    milliseconds = {name: 1e3 * needed[name] / measured[name]["median"] for name in needed}
    return {
        "remembered": len(memory),
        **needed,
        "a_second": measured,
        "milliseconds": {**milliseconds, "floor": max(milliseconds.values())},
    }
