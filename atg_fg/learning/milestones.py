"""When what is learned is looked at again as a whole: ever more rarely, so that the work is bounded."""

from __future__ import annotations

from typing import Final

#: Up to so many trials each is a milestone; from there on the number grows by a quarter from one to the next.
DENSE_MILESTONES: Final = 8


def is_milestone(n_trials: int) -> bool:
    """Return whether structures are searched for, and rates estimated, after this many trials."""
    return next_milestone(n_trials - 1) == n_trials


def next_milestone(n_trials: int) -> int:
    """Return the first milestone after this many trials."""
    if n_trials < DENSE_MILESTONES:
        return n_trials + 1
    milestone = DENSE_MILESTONES
    while milestone <= n_trials:
        milestone = -(-milestone * 5 // 4)
    return milestone
