"""One trial as a chain of plain arrays: what every exact engine and the factor graph are made from.

Learning within the trial changes the tables from step to step. It depends on the evidence alone, not on the
belief, so the chain of a trial can be made again at any time from what was done and seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np

from atg_fg.core.belief import IdentityBelief
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.log_math import log_of
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import FloatArray
from atg_fg.inference.history import History
from atg_fg.inference.recognition_model import COLLECTION, RecognitionModel

#: ln of the least weight of a trial that plain numbers hold with all their digits, and something to spare.
LN_LEAST: Final = -600.0


@dataclass(frozen=True, eq=False)
class Chain:
    """Factors of p(O, X_0:t, z_0:t | a_1:t), with H hypotheses and W_s (padded) states at time s.

    Attributes:
        prior: p(O), shape [H].
        initial: p(X_0 | O), shape [H, W_0].
        transitions: p(X_s | X_{s-1}, a_s, O) for s = 1 … t, each of shape [H, W_{s-1}, W_s].
        likelihoods: p(z_s | X_s, O) for each look, each of shape [H, W_s]; one less than there are
            variables X if the trial ended with an action.
        objects: p(what was felt of the object | O, what was felt before), each with the time of its look, of shape [H].
    """

    prior: FloatArray
    initial: FloatArray
    transitions: tuple[FloatArray, ...]
    likelihoods: tuple[FloatArray, ...]
    objects: tuple[tuple[int, FloatArray], ...] = ()

    @property
    def widths(self) -> tuple[int, ...]:
        """W_s for every time s."""
        return (self.initial.shape[1], *(transition.shape[2] for transition in self.transitions))

    def given(self, hypothesis: int) -> Chain:
        """Return the chain under one hypothesis alone (H = 1)."""
        return Chain(
            self.prior[[hypothesis]],
            self.initial[[hypothesis]],
            tuple(table[[hypothesis]] for table in self.transitions),
            tuple(table[[hypothesis]] for table in self.likelihoods),
            tuple((time, table[[hypothesis]]) for time, table in self.objects),
        )

    def scaled(self) -> tuple[Chain, float]:
        """Return the chain with every likelihood divided by its greatest value, and the sum of their logarithms.

        So evidence on any scale stays within the range of floats. A likelihood that is zero throughout is kept.
        """
        tables = [*self.likelihoods, *(table for _, table in self.objects)]
        greatest = [float(table.max()) or 1.0 for table in tables]
        scaled = [table / scale for table, scale in zip(tables, greatest, strict=True)]
        n_looks = len(self.likelihoods)
        objects = tuple((time, table) for (time, _), table in zip(self.objects, scaled[n_looks:], strict=True))
        return replace(self, likelihoods=tuple(scaled[:n_looks]), objects=objects), float(np.log(greatest).sum())

    @property
    def log_identity(self) -> FloatArray:
        """Ln of p(O) and all that was felt of the object, shape [H]: what is known of O but for its aspects."""
        return log_of(self.prior) + sum((log_of(table) for _, table in self.objects), np.zeros(len(self.prior)))

    def balanced(self) -> tuple[Chain, float]:
        """Return the chain of one hypothesis with each likelihood over p(z_s | z_0:s-1), and the sum of their ln.

        So the weight of a whole trial is p(O), however improbable its looks are. The chain stays as it is where its
        numbers are large enough, and from a look on that is impossible.
        """
        logarithms = np.array([float(log_joint[0]) for log_joint in forward_pass(self).log_joints])
        if logarithms.min() > LN_LEAST:
            return self, 0.0
        possible = logarithms[np.isfinite(logarithms)]
        logs = np.zeros(len(self.widths))
        logs[: len(possible)] = np.diff(possible, prepend=float(log_of(self.prior)[0])) if len(possible) else 0.0
        logs = logs[: len(self.likelihoods)]
        likelihoods = tuple(table / np.exp(log) for table, log in zip(self.likelihoods, logs, strict=True))
        return replace(self, likelihoods=likelihoods), float(logs.sum())


def build_chain(
    memory: RobotMemory,
    parameters: ModelParameters,
    history: History,
    hypotheses: Sequence[int] | None = None,
    prior: IdentityBelief | None = None,
) -> Chain:
    """Return the chain of a trial, for all hypotheses or for some of them, from the memory's p(O) or from ``prior``.

    With learning within the trial the state space of X_s is the one *after* z_s was learned from: a new aspect is
    reached as its collection node was, and the two share that node's likelihood as ``docs/model.md`` says.
    """
    if not history.evidence:
        raise InvalidInputError("trial: nothing observed yet; expected a first observation")
    model = RecognitionModel(memory, parameters, prior)
    chosen = list(range(model.n_hypotheses)) if hypotheses is None else list(hypotheses)
    incoming: list[FloatArray] = []
    likelihoods: list[FloatArray] = []
    objects: list[tuple[int, FloatArray]] = []
    for step, evidence in enumerate(history.evidence):
        table = model.transition(history.actions[step - 1]) if step else model.base_row
        likelihood = model.pattern_likelihood(evidence)
        if evidence.measured:
            objects.append((step, model.objects.likelihood(evidence.measured)[chosen]))
        revelation = model.learn_from(history, step)
        if revelation is not None:
            padding = [(0, 0)] * (table.ndim - 1) + [(0, model.n_states - table.shape[-1])]
            table, likelihood = np.pad(table, padding), np.pad(likelihood, padding[-2:])
            table[revelation.hypotheses, ..., revelation.states] = table[revelation.hypotheses, ..., COLLECTION]
            revelation.move(likelihood)
        incoming.append(table[chosen])
        likelihoods.append(likelihood[chosen])
    if history.awaits_evidence:
        incoming.append(model.transition(history.actions[-1])[chosen])
    return Chain(model.prior[chosen], incoming[0], tuple(incoming[1:]), tuple(likelihoods), tuple(objects))


class ForwardPass(NamedTuple):
    """The Bayes filter of a whole chain, one object at a time, as logarithms where numbers may be small.

    Attributes:
        log_joints: ln p(O, z_0:s | a_1:s) for every time s, −∞ where an object is ruled out, each of shape [H].
        filtered: p(X_s | O, z_0:s, a_1:s) for every time s, each of shape [H, W_s]; zero where an object is ruled out.
    """

    log_joints: tuple[FloatArray, ...]
    filtered: tuple[FloatArray, ...]

    @property
    def log_joint(self) -> FloatArray:
        """Return ln p(O, z_0:t | a_1:t) at the end of the trial, shape [H]."""
        return self.log_joints[-1]


def forward_pass(chain: Chain) -> ForwardPass:
    """Return the forward pass of a chain."""
    log_joint = log_of(chain.prior)
    log_joints: list[FloatArray] = []
    filtered: list[FloatArray] = []
    predicted = chain.initial
    for time in range(len(chain.widths)):
        if time:
            predicted = np.matmul(filtered[-1][:, None, :], chain.transitions[time - 1])[:, 0, :]
        joint = predicted * chain.likelihoods[time] if time < len(chain.likelihoods) else predicted
        total = joint.sum(axis=1)
        log_joint = log_joint + log_of(total)
        log_joint = log_joint + sum((log_of(table) for at, table in chain.objects if at == time), np.zeros(len(total)))
        log_joints.append(log_joint)
        filtered.append(joint / np.where(total > 0, total, 1.0)[:, None])
    return ForwardPass(tuple(log_joints), tuple(filtered))


def forward_backward(chain: Chain) -> list[FloatArray]:
    """Return p(X_s | O, z_0:t, a_1:t) of a chain with one hypothesis, each of shape [W_s]."""
    likelihoods = [table[0] for table in chain.likelihoods]
    likelihoods += [np.ones(width) for width in chain.widths[len(likelihoods) :]]
    forward = [_normalised(chain.initial[0] * likelihoods[0])]
    for transition, likelihood in zip(chain.transitions, likelihoods[1:], strict=True):
        forward.append(_normalised(forward[-1] @ transition[0] * likelihood))
    backward = [np.ones(chain.widths[-1])]
    for transition, likelihood in zip(reversed(chain.transitions), reversed(likelihoods[1:]), strict=True):
        backward.append(_normalised(transition[0] @ (likelihood * backward[-1])))
    return [_normalised(past * future) for past, future in zip(forward, reversed(backward), strict=True)]


def _normalised(mass: FloatArray) -> FloatArray:
    total = mass.sum()
    return mass / total if total > 0 else mass
