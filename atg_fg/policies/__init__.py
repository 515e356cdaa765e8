"""Policies by name. A new policy is one class, in a file of its own or beside its like, and one line here."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Final

from atg_fg.core.errors import unknown_name
from atg_fg.core.plugins import imported, loaded, registered
from atg_fg.policies.agent import AgentPolicy, SampledPolicy, as_policy
from atg_fg.policies.base import Choice, Policy
from atg_fg.policies.exploration import ExplorationPolicy
from atg_fg.policies.goal import GoalPolicy
from atg_fg.policies.information_gain import EntropyPolicy, RandomPolicy
from atg_fg.policies.lookahead import LookaheadPolicy
from atg_fg.policies.stopping import StoppingPolicy, check_entropy_threshold

__all__ = [
    "POLICIES",
    "AgentPolicy",
    "Choice",
    "EntropyPolicy",
    "ExplorationPolicy",
    "GoalPolicy",
    "LookaheadPolicy",
    "Policy",
    "RandomPolicy",
    "SampledPolicy",
    "StoppingPolicy",
    "as_policy",
    "check_entropy_threshold",
    "make_policy",
]

#: Makers of policies by name, of those that need nothing but the belief; ``GoalPolicy`` needs a goal, too.
POLICIES: Final[dict[str, Callable[[], Policy]]] = {
    EntropyPolicy.name: EntropyPolicy,
    "lookahead-2": partial(LookaheadPolicy, 2),
    "lookahead-2-pruned": partial(LookaheadPolicy, 2, least_weight=1e-2),
    "lookahead-3": partial(LookaheadPolicy, 3, least_weight=1e-2),
    RandomPolicy.name: RandomPolicy,
    ExplorationPolicy.name: ExplorationPolicy,
}


def make_policy(name: str, entropy_threshold: float | None = None) -> Policy:
    """Return the policy named ``name``.

    Args:
        name: In ``POLICIES``; registered by another package by the entry point ``atg_fg.policies``; or
            ``module:object`` of a user's own: a policy, an agent with ``predict``, or a space of actions.
        entropy_threshold: Entropy of the verdict, nats, at which the policy ends the trial; it never does if not given.

    Raises:
        UnknownNameError: There is no such policy.
        InvalidInputError: The user's own cannot be imported, or is no policy; or the threshold is not a finite entropy
            above 0.
    """
    policy = _policy(name)
    return policy if entropy_threshold is None else StoppingPolicy(policy, entropy_threshold)


def _policy(name: str) -> Policy:
    if not isinstance(name, str):
        raise unknown_name("policy", name, POLICIES)
    if name in POLICIES:
        return POLICIES[name]()
    others = registered("atg_fg.policies")
    if name not in others and ":" not in name:
        raise unknown_name("policy", name, [*POLICIES, *others])
    found = loaded("policy", others[name]) if name in others else imported("policy", name)
    return as_policy(found, f"policy {name!r}")
