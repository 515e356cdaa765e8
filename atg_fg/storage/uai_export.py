"""A scripted trial as a discrete factor graph for other solvers: O, X_0 … X_t, Z_0 … Z_n, and its evidence.

The factors are those of ``atg_fg.inference.factor_graph``, but what was seen is a variable: p(z_s | X_s, O) is a table
over all patterns, a complete look is evidence about Z_s, and a partial one a factor on Z_s alone, its likelihood.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np

from atg_fg.core.errors import TooLargeError
from atg_fg.core.patterns import Evidence, FloatArray
from atg_fg.inference.chain import Chain, build_chain
from atg_fg.inference.elimination.discrete_model import DiscreteModel, ModelFactor
from atg_fg.inference.history import History
from atg_fg.storage.scripted_trial import ScriptedTrial

#: A file of so many numbers has some 350 MB.
MAX_EXPORT_ENTRIES: Final = 2**24


class ExportedTrial(NamedTuple):
    """A trial as a discrete model.

    Attributes:
        model: Variable 0 is O: the remembered objects in their order, then *unseen*. The next are X_0 … X_t: state 0 is
            the collection node, state 1 + k the k-th known aspect, and aspects that an object lacks have probability
            zero under it. The last are Z_0 … Z_n, one a look, over the pattern alphabet in its order.
        evidence: The pattern of each Z that was seen completely.
        names: Names of the variables: O, X0, …, Z0, ….
    """

    model: DiscreteModel
    evidence: dict[int, int]
    names: tuple[str, ...]


def export_trial(script: ScriptedTrial) -> ExportedTrial:
    """Return a scripted trial as a model whose p(O), given its evidence, is that of the trial, and whose Z is p(z | a).

    With learning within the trial the tables are those that this evidence leads to: they are not the model of other
    evidence.

    Raises:
        TooLargeError: The tables have over ``MAX_EXPORT_ENTRIES`` numbers.
    """
    history = History(
        [step for step in script.steps if isinstance(step, Evidence)],
        [step for step in script.steps if not isinstance(step, Evidence)],
    )
    chain = build_chain(script.memory, script.parameters, history)
    n_patterns = len(script.memory.assumptions.alphabet)
    _check_size(chain, n_patterns)
    first_pattern = 1 + len(chain.widths)
    factors = [ModelFactor((0,), chain.prior), ModelFactor((0, 1), chain.initial)]
    factors += [ModelFactor((0,), table) for _, table in chain.objects]
    factors += [
        ModelFactor((0, time, time + 1), transition) for time, transition in enumerate(chain.transitions, start=1)
    ]
    evidence = {}
    for time, (table, look) in enumerate(zip(_observation_tables(script, history), history.evidence, strict=True)):
        factors.append(ModelFactor((0, 1 + time, first_pattern + time), table))
        if look.pattern is None:
            factors.append(ModelFactor((first_pattern + time,), look.likelihood))
        else:
            evidence[first_pattern + time] = look.pattern
    cardinalities = (len(chain.prior), *chain.widths, *[n_patterns] * len(history.evidence))
    names = ("O", *(f"X{time}" for time in range(len(chain.widths))), *(f"Z{n}" for n in range(len(history.evidence))))
    return ExportedTrial(DiscreteModel(cardinalities, tuple(factors)), evidence, names)


def _observation_tables(script: ScriptedTrial, history: History) -> list[FloatArray]:
    """Return p(z | X_s, O) of all patterns for each look, each of shape [H, W_s, |𝒵|].

    A look that only pretends to have been another, but is learned from as what it was, gives one column of each table.
    So a new aspect and its collection node share every pattern as they share the one that was seen.
    """
    columns: list[tuple[FloatArray, ...]] = []
    for likelihood in np.eye(len(script.memory.assumptions.alphabet)):
        pretended = [replace(look, likelihood=likelihood) for look in history.evidence]
        columns.append(build_chain(script.memory, script.parameters, History(pretended, history.actions)).likelihoods)
    return [np.stack(column, axis=-1) for column in zip(*columns, strict=True)]


def _check_size(chain: Chain, n_patterns: int) -> None:
    looks = sum(table.size for table in chain.likelihoods) * n_patterns
    entries = looks + sum(table.size for table in (chain.prior, chain.initial, *chain.transitions))
    if entries > MAX_EXPORT_ENTRIES:
        raise TooLargeError(
            f"export: the tables would have {entries} entries ({8 * entries} bytes); "
            f"the limit is {MAX_EXPORT_ENTRIES} entries"
        )
