"""Policies by name. A new policy is one class, in a file of its own or beside its like, and one line here."""

from __future__ import annotations

from typing import Final

from atg_fg.errors import unknown_name
from atg_fg.policies.base import Choice, Policy, best_actions
from atg_fg.policies.exploration import ExplorationPolicy
from atg_fg.policies.goal import GoalPolicy
from atg_fg.policies.recognition import EntropyPolicy, RandomPolicy

__all__ = [
    "POLICIES",
    "Choice",
    "EntropyPolicy",
    "ExplorationPolicy",
    "GoalPolicy",
    "Policy",
    "RandomPolicy",
    "best_actions",
    "make_policy",
]

#: Policies that need nothing but the belief; ``GoalPolicy`` needs a goal, too.
POLICIES: Final[dict[str, type[Policy]]] = {
    policy.name: policy for policy in (EntropyPolicy, RandomPolicy, ExplorationPolicy)
}


def make_policy(name: str) -> Policy:
    """Return the policy named ``name``, or raise ``UnknownNameError``."""
    if name not in POLICIES:
        raise unknown_name("policy", name, POLICIES)
    return POLICIES[name]()
