"""What was seen and done in a trial."""

from __future__ import annotations

from dataclasses import dataclass, field

from atg_fg.core.patterns import Evidence


@dataclass
class History:
    """What was seen and done in a trial: z_0, a_1, z_1, …; it may end with an action.

    Attributes:
        evidence: The evidence of each look.
        actions: Index of each action; as many as looks, or one less.
    """

    evidence: list[Evidence] = field(default_factory=list)
    actions: list[int] = field(default_factory=list)

    @property
    def awaits_evidence(self) -> bool:
        """Whether the next entry is a look rather than an action."""
        return len(self.evidence) == len(self.actions)

    def step(self, time: int) -> tuple[int | None, int | None, int | None]:
        """Return the pattern of the look before ``time``, the action since then and the pattern of the look at it.

        A pattern is ``None`` if the look was not complete; the first look has none before it.
        """
        pattern = self.evidence[time].pattern
        return (self.evidence[time - 1].pattern, self.actions[time - 1], pattern) if time else (None, None, pattern)
