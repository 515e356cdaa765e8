"""A trial told on the terminal: what was seen, what is believed, what is done next and why."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from rich.console import Console

from atg_fg.core.belief import IdentityBelief
from atg_fg.core.memory import RobotMemory
from atg_fg.core.records import Mistake, TrialRecord, TrialStep

_BAR = 24


class Story:
    """Tells the steps of one trial.

    Args:
        console: Where to print.
        memory: The robot memory the trial began with.
        also: Called with each step, too, once it is told.
    """

    def __init__(
        self, console: Console, memory: RobotMemory, also: Callable[[TrialStep], None] = lambda _: None
    ) -> None:
        self.console, self._also = console, also
        self.assumptions = memory.assumptions
        self.names = memory.names
        self._time = 0

    def tell(self, step: TrialStep) -> None:
        """Print one look, the belief after it and the action chosen."""
        seen = ", ".join(
            f"{slot} {'not seen' if symbol is None else self.assumptions.alphabet.name_of(symbol)}"
            for slot, symbol in zip(self.assumptions.alphabet.slots, step.detection, strict=True)
        )
        self.console.print(f"look {self._time}: {seen}", style="bold")
        for name, probability in self._top(step.belief):
            bar = "█" * round(_BAR * probability)
            self.console.print(f"    {name:<12} {probability:6.1%} {bar}")
        self.console.print(f"    entropy of identity {step.belief.entropy:.3f} nats")
        if step.total_variation_bound is not None:
            self.console.print(f"    off by a total variation of at most {step.total_variation_bound:.1e}")
        if step.action is not None:
            chosen = self.assumptions.actions[step.action]
            self.console.print(f"  → {chosen}{self._reasons(step)}")
        self._time += 1
        self._also(step)

    def verdict(self, record: TrialRecord) -> None:
        """Print what the object was judged to be."""
        belief = record.belief
        if record.verdict == "lost":
            text = "verdict: none, the object was lost"
        elif record.verdict == "undecided":
            text = "verdict: none, nothing was seen"
        elif record.verdict == "novel":
            text = f"verdict: a new object (unseen with probability {belief.unseen:.1%})"
        else:
            best = belief.most_probable_object
            probability = 0.0 if best is None else float(belief.objects[best])
            text = f"verdict: {record.matched} (probability {probability:.1%})"
        self.console.print(text, style="bold green")

    def mistakes(self, wrong: Sequence[Mistake]) -> None:
        """Print which labels were probably wrong."""
        slots = self.assumptions.alphabet.slots
        for look, slot, probability in wrong:
            self.console.print(f"look {look}, {slots[slot]}, was probably a mistake: {probability:.0%}")

    def _top(self, belief: IdentityBelief) -> list[tuple[str, float]]:
        """Return the three most probable remembered objects, and *unseen*."""
        order = belief.objects.argsort(kind="stable")[::-1][:3]
        return [*((self.names[index], float(belief.objects[index])) for index in order), ("unseen", belief.unseen)]

    def _reasons(self, step: TrialStep) -> str:
        if step.expected_entropies is None:
            return ""
        pairs = zip(self.assumptions.actions, step.expected_entropies, strict=True)
        return "   (expected entropy: " + ", ".join(f"{name} {value:.3f}" for name, value in pairs) + ")"
