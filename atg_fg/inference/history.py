"""What was seen and done in a trial."""

from __future__ import annotations

from dataclasses import dataclass, field

from atg_fg.core.actions import NOTHING, AnyAction, UncertainAction
from atg_fg.core.patterns import Evidence


@dataclass
class History:
    """What was seen and done in a trial: z_0, a_1, z_1, …; it may end with an action.

    Attributes:
        evidence: The evidence of each look.
        actions: What was done after each look, as many as looks, or one less. Between two looks at rest nothing
            happened.
    """

    evidence: list[Evidence] = field(default_factory=list)
    actions: list[AnyAction] = field(default_factory=list)

    @property
    def awaits_evidence(self) -> bool:
        """Whether the next entry is a look rather than an action."""
        return len(self.evidence) == len(self.actions)

    def step(self, time: int) -> tuple[int | None, int | None, int | None]:
        """Return the pattern of the look before ``time``, the action since then and the pattern of the look at it.

        A pattern is ``None`` if the look was not complete; the first look has none before it. Of several looks at rest
        the first complete one says what is seen there. An action that is not sure is none to learn from.
        """
        pattern = self.evidence[time].pattern
        if not time:
            return None, None, pattern
        before, action = self._pattern_at_rest(time - 1), self.actions[time - 1]
        if isinstance(action, UncertainAction):
            return None, None, None if action == NOTHING and before is not None else pattern
        return before, action, pattern

    def _pattern_at_rest(self, time: int) -> int | None:
        """Return what the first complete look shows of those at rest up to a time."""
        first = time
        while first and self.actions[first - 1] == NOTHING:
            first -= 1
        return next((look.pattern for look in self.evidence[first : time + 1] if look.pattern is not None), None)

    def looks_at_rest(self) -> list[int]:
        """Return the times of the looks since something was done last."""
        first = len(self.evidence) - 1
        while first > 0 and self.actions[first - 1] == NOTHING:
            first -= 1
        return list(range(max(first, 0), len(self.evidence)))
