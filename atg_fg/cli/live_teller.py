"""A live session told on the terminal, and on a page if there is one; what a person says goes back to it."""

from __future__ import annotations

import json
import queue
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from rich.console import Console

from atg_fg.cli.story import Story
from atg_fg.core.belief import IdentityBelief
from atg_fg.core.errors import CameraError
from atg_fg.core.records import TrialRecord, TrialStep
from atg_fg.experiments.live_session import Asked, Ended, Event, LiveSession, Looked, Noted
from atg_fg.senses.opencv import png_of
from atg_fg.storage import plain_files
from atg_fg.storage.trial_log import to_json_lines

if TYPE_CHECKING:
    from atg_fg.display.live_page import LivePage
    from atg_fg.senses.video import Frame, FrameSource

#: What a person can say besides the names of actions.
WORDS: Final = ("learn", "new", "quit")
_NOTHING: Final = "nothing"  # the answer that the cube was not turned
#: What comes after the last line of input: nobody is there to answer.
NOBODY: Final = "\x04"
_SHOWN: Final = 4  # objects on the page


class LiveTeller:
    """Runs a session from its frames to its end.

    Args:
        begin: Makes the session when the first frame is there.
        console: Where to print.
        words: What a person says.
        page: Shows the same, if there is one.
        pictures: A folder for a picture of each look, if they are wanted.
        on_trial: Called with the record of each trial, and the name of the ATG that learned from it.

    Attributes:
        trials: Each trial as JSON.
    """

    def __init__(
        self,
        begin: Callable[[Frame], LiveSession],
        console: Console,
        words: queue.Queue[str],
        page: LivePage | None = None,
        pictures: Path | None = None,
        on_trial: Callable[[LiveSession, TrialRecord, str | None], None] = lambda *_: None,
    ) -> None:
        self._begin, self._console, self._words = begin, console, words
        self._page, self._pictures, self._on_trial = page, pictures, on_trial
        self.trials: list[dict[str, Any]] = []
        self._session: LiveSession | None = None
        self._story: Story | None = None
        self._early: list[str] = []  # answers given before they were asked for
        self._is_alone = False
        self._say, self._note, self._quit, self._n_looks = "put a cube before the camera", "", False, 0
        self._step: TrialStep | None = None

    def run(self, frames: FrameSource) -> None:
        """Take in all frames.

        Raises:
            CameraError: There were no frames, none in time, or none in which a cube stood.
        """
        for frame in frames:
            if self._session is None:
                self._session = self._begin(frame)
            self._tell(self._session.take(frame))
            while not (self._quit or self._words.empty()):
                self._hear(self._words.get())
            self._show()
            if self._quit:
                break
        if self._session is not None:
            self._tell(self._session.end())
        self._show()
        if not self.trials and not self._quit:
            why = f": {self._note}" if self._note else ""
            raise CameraError(f"{frames.place}: no cube was seen at rest{why}; expected one with the tags that count")

    def _tell(self, events: Iterable[Event]) -> None:
        for event in events:
            match event:
                case Looked():
                    self._tell_look(event)
                case Ended():
                    self._tell_end(event)
                case Noted():
                    self._note = event.text
                    self._console.print(f"note: {event.text}", soft_wrap=True)
                case Asked():
                    self._ask()

    def _tell_look(self, event: Looked) -> None:
        assert self._session is not None
        assumptions = self._session.memory.assumptions
        self._early.clear()
        if self._story is None:
            self._console.print(f"trial {len(self.trials)}", style="bold blue")
            self._story = Story(self._console, self._session.memory)
        if event.turn:
            self._console.print(f"  turned: {', '.join(event.turn)}")
        self._story.tell(event.step)
        self._step = event.step
        action = None if event.step.action is None else assumptions.actions[event.step.action]
        if event.step.purpose is None:
            self._say = f"now do: {action}"
        else:
            further = f"; to learn more of it, do: {action}" if action else ": take the cube away, or go on"
            self._say = f"{self._verdict()}{further}"
            self._console.print(f"  {self._say}", soft_wrap=True)
        if self._pictures is not None and (picture := self._session.picture) is not None:
            plain_files.write_bytes_atomically(self._pictures / f"look-{self._n_looks:04d}.png", png_of(picture))
        self._n_looks += 1

    def _tell_end(self, event: Ended) -> None:
        assert self._story is not None
        assert self._session is not None
        record = event.record
        self._story.verdict(record)
        if event.learned is not None:
            self._console.print(f"learned: {event.learned}", soft_wrap=True)
        self._on_trial(self._session, record, event.learned)
        lines = to_json_lines(record).splitlines()
        self.trials.append(
            {
                "trial": len(self.trials),
                "verdict": record.verdict,
                "matched": record.matched,
                "learned": event.learned,
                "steps": [json.loads(line) for line in lines[1:-1]],
            }
        )
        what = record.matched or {"novel": "a new object"}.get(record.verdict, "not seen")
        self._say, self._story = f"that was {what}; next cube, please", None

    def _verdict(self) -> str:
        assert self._session is not None
        assert self._session.trial is not None
        record = self._session.trial.record
        if record.verdict == "undecided":
            return "nothing was seen"
        return f"it is {record.matched or 'a new object'}"

    def _hear(self, word: str) -> None:
        """Do what a person has said."""
        assert self._session is not None
        word = word.strip().lower()
        if word == "learn":
            self._session.learn = True
            self._console.print("this trial will be learned from when it ends")
        elif word == "new":
            self._tell(self._session.begin_anew())
        elif word == "quit":
            self._quit = True
        elif word == NOBODY:
            self._is_alone = True
        elif word in (*self._session.memory.assumptions.actions, _NOTHING):
            self._early.append(word)
        elif word:
            self._console.print(f"{word!r}: expected one of: {', '.join(WORDS)}", soft_wrap=True)

    def _ask(self) -> None:
        """Ask how the cube was turned until someone says it."""
        assert self._session is not None
        answers = (*self._session.memory.assumptions.actions, _NOTHING, "new")
        self._say = f"how was the cube turned? {', '.join(answers)}"
        self._console.print(self._say)
        self._show(answers)
        while True:
            word = self._next_answer()
            if word == "quit":
                self._quit = True
                return
            if word in answers:
                turn = None if word == "new" else () if word == _NOTHING else (word,)
                self._tell(self._session.answer(turn))
                return
            self._console.print(f"{word!r}: expected one of: {', '.join(answers)}", soft_wrap=True)

    def _next_answer(self) -> str:
        if self._early:
            return self._early.pop(0)
        word = "new" if self._is_alone else self._words.get().strip().lower()
        if word == NOBODY:
            self._is_alone = True
            return "new"
        return word

    def _show(self, words: tuple[str, ...] = WORDS) -> None:
        """Bring the page up to date."""
        if self._page is None:
            return
        from atg_fg.display.live_page import PageState

        session, step = self._session, self._step
        belief: tuple[tuple[str, float], ...] = ()
        seen = ""
        if session is not None and session.trial is not None and step is not None:
            belief = _most_probable(step.belief, session.trial.record.names)
            slots = session.memory.assumptions.alphabet.slots
            seen = ", ".join(
                f"{slot} {'not seen' if symbol is None else symbol}"
                for slot, symbol in zip(slots, step.detection, strict=True)
            )
        state = PageState(self._say, seen, belief, self._note, words)
        self._page.show(state, None if session is None else session.picture)


def _most_probable(belief: IdentityBelief, names: tuple[str, ...]) -> tuple[tuple[str, float], ...]:
    """Return the most probable objects, and that it is none of those met before."""
    every = [*zip(names, belief.objects.tolist(), strict=True), ("a new object", belief.unseen)]
    return tuple(sorted(every, key=lambda each: -each[1])[:_SHOWN])
