"""A person turns cubes before a camera: trial after trial, from frames to verdicts and memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import Evidence
from atg_fg.core.records import TrialRecord, TrialStep
from atg_fg.experiments.recognition_agent import RecognitionAgent
from atg_fg.experiments.trial import learn_from
from atg_fg.policies import Choice, ExplorationPolicy, Policy
from atg_fg.senses.tag_drawing import draw_slots
from atg_fg.senses.tags import DetectedTag, TagDetector
from atg_fg.senses.turns import CubeAtRest, CubeTakenAway, TurnWatcher
from atg_fg.senses.video import Frame


class LiveTrial:
    """One trial of an agent, on record look by look.

    Args:
        agent: Recognises the object and proposes actions, until no more are needed. Its memory is not changed.
        teaching: Proposes actions when no more are needed for the verdict, so that there is more to learn from.

    Attributes:
        record: The trial so far. The action of its last step is the one proposed, until ``acted`` says what was done.
    """

    def __init__(self, agent: RecognitionAgent, teaching: Policy | None = None) -> None:
        agent.reset()
        self._agent, self._teaching = agent, teaching
        self.record = TrialRecord(agent.memory.names, agent.memory.assumptions)

    def look(self, evidence: Evidence) -> TrialStep:
        """Take in a look and return the step, with the action that is proposed next; ``None`` if no more is needed.

        Of looks at rest, without an action between them, the one that says most counts alone, and is on record.

        Args:
            evidence: What the look says about the pattern shown; its detection goes into the record.

        Raises:
            ImpossibleEvidenceError: The evidence has probability zero under the model; nothing has changed.
        """
        agent, steps = self._agent, self.record.steps
        agent.observe(evidence, independent=False)
        inference = agent.inference
        counts = inference.history.evidence[-1]
        choice = agent.choice()
        if choice.action is None and self._teaching is not None:
            choice = agent.choice(self._teaching)
            choice = Choice(choice.action, choice.expected_entropies, "learn")
        step = TrialStep(
            counts.detection or (None,) * len(self.record.assumptions.alphabet.slots),
            counts.pattern,
            inference.identity(),
            inference.log_evidence,
            {"confidences": list(counts.confidences)} if any(counts.confidences) else {},
            choice.expected_entropies,
            choice.action,
            choice.purpose,
            None if inference.exact else inference.total_variation_bound,
        )
        steps[len(inference.history.evidence) - 1 :] = [step]
        return step

    def acted(self, actions: Sequence[int]) -> None:
        """Take in what was done, whether it was proposed or not; between two actions nothing was seen.

        Raises:
            InvalidInputError: Nothing was seen yet, no action is given, or there is no such action.
        """
        if not self.record.steps or not actions:
            raise InvalidInputError(f"actions: {list(actions)}; expected some, after a look")
        nothing = Evidence.of_detection(alphabet := self.record.assumptions.alphabet, (None,) * len(alphabet.slots))
        for number, action in enumerate(actions):
            if number:
                self.look(nothing)
            self._agent.did(action)
            self.record.steps[-1] = replace(self.record.steps[-1], action=action)

    def ended(self) -> TrialRecord:
        """Return the record without the proposal that nobody followed."""
        steps = self.record.steps
        if steps:
            steps[-1] = replace(steps[-1], action=None)
        return self.record


@dataclass(frozen=True, eq=False)
class Looked:
    """The cube was looked at.

    Attributes:
        turn: What was done since the last look, in order.
        step: What was seen, what is believed, and what to do next.
    """

    turn: tuple[str, ...]
    step: TrialStep


@dataclass(frozen=True, eq=False)
class Ended:
    """A trial has ended.

    Attributes:
        record: All of it.
        learned: Name of the ATG that learned from it, if any did.
    """

    record: TrialRecord
    learned: str | None


@dataclass(frozen=True)
class Noted:
    """Something odd was seen."""

    text: str


@dataclass(frozen=True)
class Asked:
    """The cube was turned, but not how is known; ``LiveSession.answer`` says it."""


Event: TypeAlias = Looked | Ended | Noted | Asked


class LiveSession:
    """Trials from frames.

    A trial begins when a cube stands before the camera, and ends when it is taken away, or when the session is told so.

    Args:
        detector: Reads the tags.
        watcher: Notices how the cube is turned.
        agent: Recognises cubes and proposes actions; its memory learns from trials.
        learns: Whether every trial is learned from; else those are for which ``learn`` is set. Then actions that were
            never tried are proposed when the verdict is settled.
        asks: Whether there is someone to ask how the cube was turned; if not, the trial ends where it is not known.

    Raises:
        InvalidInputError: The memory is of other slots, symbols or actions.

    Attributes:
        memory: The robot memory.
        learns: Whether every trial is learned from.
        learn: Whether the present trial is learned from when it ends.
        picture: The last frame with its tags drawn in, RGB.
    """

    def __init__(
        self,
        detector: TagDetector,
        watcher: TurnWatcher,
        agent: RecognitionAgent,
        *,
        learns: bool = False,
        asks: bool = False,
    ) -> None:
        _check_memory(agent.memory, watcher.actions, len(detector.tags.all_symbols))
        self.memory, self.learns, self.learn = agent.memory, learns, False
        self._detector, self._watcher, self._agent, self._asks = detector, watcher, agent, asks
        self._at_rest: dict[str, DetectedTag | None] = {}
        self._trial: LiveTrial | None = None
        self._unanswered: CubeAtRest | None = None
        self._noted: set[str] = set()
        self._draw: Callable[[], NDArray[np.uint8]] | None = None

    @property
    def picture(self) -> NDArray[np.uint8] | None:
        """The last frame with its tags drawn in, RGB; ``None`` before the first one."""
        return None if self._draw is None else self._draw()

    @property
    def trial(self) -> LiveTrial | None:
        """The present trial, if a cube is there."""
        return self._trial

    def take(self, frame: Frame) -> Iterator[Event]:
        """Take in a frame, and give what has happened.

        Raises:
            InvalidInputError: The frame is of another size than the camera was calibrated for.
        """
        tags = self._detector.detect(frame.image)
        self._draw = lambda: draw_slots(frame.image, tags, dict(self._watcher.viewpoint.slots(tags)))
        yield from self._note_oddities(tags)
        happened = self._watcher.take(frame.time, tags)
        if isinstance(happened, CubeTakenAway):
            yield from self.end()
        elif isinstance(happened, CubeAtRest):
            if happened.turn is None and self._trial is not None and self._asks:
                self._unanswered = happened
                yield Asked()
            else:
                yield from self._look(happened, happened.turn)

    def answer(self, turn: Sequence[str] | None) -> Iterator[Event]:
        """Say how the cube was turned, after it was asked; ``None`` if it is another cube.

        Raises:
            InvalidInputError: Nothing was asked, or there is no such action.
        """
        if self._unanswered is None:
            raise InvalidInputError("answer: nothing was asked; expected a question first")
        actions = self.memory.assumptions.actions
        for name in turn or ():
            if name not in actions:
                raise InvalidInputError(f"action: {name!r}; expected one of: {', '.join(actions)}")
        rest, self._unanswered = self._unanswered, None
        yield from self._look(rest, None if turn is None else tuple(turn))

    def end(self) -> Iterator[Ended]:
        """End the present trial, if there is one, and learn from it if that is wanted."""
        trial, self._trial, self._unanswered = self._trial, None, None
        if trial is None or not trial.record.steps:
            return
        record = trial.ended()
        learned = learn_from(record, self.memory) if self.learns or self.learn else None
        self.learn = False
        yield Ended(record, learned)

    def begin_anew(self) -> Iterator[Event]:
        """End the present trial; what is seen next is another cube."""
        yield from self.end()
        self._watcher.forget_cube()

    def _look(self, rest: CubeAtRest, turn: tuple[str, ...] | None) -> Iterator[Event]:
        """Take in a cube at rest; where it is not known how it was turned, with it begins a trial."""
        if turn is None and self._trial is not None:
            yield Noted("it was not seen how the cube was turned: the trial ends here, and another begins")
            yield from self.end()
        if self._trial is None:
            self._trial = LiveTrial(self._agent, ExplorationPolicy() if self.learns else None)
            self._at_rest, turn = {}, ()
        elif turn:
            self._trial.acted([self.memory.assumptions.action_index(name) for name in turn])
            self._at_rest = {}
        before = self._at_rest
        # It stands as it stood: what was hidden then may be seen now.
        self._at_rest = {slot: tag or before.get(slot) for slot, tag in rest.slots.items()}
        if before and all(tag is None or before[slot] is not None for slot, tag in rest.slots.items()):
            return
        evidence = self._detector.evidence(self.memory.assumptions.alphabet, self._at_rest)
        yield Looked(turn or (), self._trial.look(evidence))

    def _note_oddities(self, tags: Sequence[DetectedTag]) -> Iterator[Noted]:
        """Say once what no cube of these tags can show."""
        ids = [tag.id for tag in tags]
        odd = {f"tag {tag_id} is in view twice: it is not believed" for tag_id in ids if ids.count(tag_id) > 1}
        if tags and all(tag.symbol is None for tag in tags):
            odd.add(f"tags {', '.join(map(str, sorted(set(ids))))} are none of the tags that count")
        for text in sorted(odd - self._noted):
            self._noted.add(text)
            yield Noted(text)


def _check_memory(memory: RobotMemory, actions: Sequence[str], n_symbols: int) -> None:
    """Refuse a memory of other things than cubes with these tags."""
    assumptions = memory.assumptions
    found = (assumptions.alphabet.slots, assumptions.alphabet.n_symbols, assumptions.actions)
    expected = (("front", "top"), n_symbols, tuple(actions))
    for what, has, needs in zip(("slots", "number of symbols", "actions"), found, expected, strict=True):
        if has != needs:
            raise InvalidInputError(f"memory: {what} {has}; expected {needs}, those of the cubes before the camera")
