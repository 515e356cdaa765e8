"""What no row of a recording shows by itself: it says little, or speaks against what is assumed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import Final

import numpy as np

from atg_fg.core.recordings import RecordedTrial, Recording
from atg_fg.storage.recording_csv import Fault

#: Times that an action must have been done between two whole looks to be called still.
_COMPARED: Final = 5
#: How many times further off than half of the readings of a trial one is odd.
_FAR: Final = 30.0
#: Standard deviation of normal errors, in units of the one that half of them are below.
_ERROR: Final = 1.4826


def oddities(recording: Recording) -> Iterator[Fault]:
    """Yield what no row shows by itself: what is recorded says little, or speaks against what is assumed."""
    trials, everywhere = recording.trials, "all trials"
    used = Counter(action for trial in trials for action in trial.actions if action)
    if len(used) == 1:
        yield _odd("one action", everywhere, f"{next(iter(used))!r} alone; expected several actions")
    for action in recording.actions if len(recording.actions) > 1 else ():
        if not used[action]:
            yield _odd("unused action", everywhere, f"{action!r} is never done; expected it to occur")
    for trial in trials:
        if len(trial.looks) == 1:
            yield _odd("one look", f"trial {trial.name}", "no action; expected several looks")
        if not any(any(look.labels) or any(look.weights) for look in trial.looks):
            yield _odd("nothing seen", f"trial {trial.name}", "nothing in any look; expected a label")
    if recording.exclusive:
        yield from _repeated_labels(trials)
    yield from _still_actions(recording, used)
    soft = any(any(look.weights) for trial in trials for look in trial.looks)
    for slot, name in enumerate(recording.slots):
        labels = {look.labels[slot] for trial in trials for look in trial.looks} - {None}
        if len(labels) < 2 and not soft:
            yield _odd("one label", f"slot {name}", f"{len(labels)} labels; expected several")
    for name in recording.sense_names:
        yield from _odd_readings(name, trials)
    objects = {trial.object for trial in trials if trial.object is not None}
    if recording.n_objects is not None and len(objects) > recording.n_objects:
        what = f"{len(objects)} objects are named; expected at most {recording.n_objects}"
        yield _odd("more objects", "column 'object'", what)


def _odd_readings(name: str, trials: Sequence[RecordedTrial]) -> Iterator[Fault]:
    """Yield what speaks against readings that err each by itself, and less than objects differ."""
    groups = {trial.name: np.array(readings) for trial in trials if (readings := trial.readings_of(name))}
    repeated, place = [each for each in groups.values() if len(each) > 1], f"sense {name}"
    values = {float(value) for each in groups.values() for value in each}
    if len(values) < 2:
        yield _odd("one reading", place, f"{len(groups)} trials with readings, all alike; expected several")
    elif repeated and all(np.ptp(each) == 0 for each in repeated):
        yield _odd("copied readings", place, "alike at all looks of a trial; expected each where it was read off alone")
    elif len(repeated) > 1 and len(groups) > _COMPARED:
        scaled = {trial: np.log(each) if min(values) > 0 else each for trial, each in groups.items()}
        errors = {trial: np.abs(each - np.median(each)) for trial, each in scaled.items() if len(each) > 1}
        error = float(np.median(np.concatenate(list(errors.values()))))
        for trial, off in errors.items():
            if error and off.max() > _FAR * error:
                far, usual = groups[trial][int(off.argmax())], np.median(groups[trial])
                yield _odd("far reading", f"trial {trial}, {place}", f"{far:g}; expected about {usual:g}")
        if np.std([np.median(each) for each in scaled.values()]) < _ERROR * error:
            yield _odd("useless readings", place, "differ in a trial as much as between trials; expected less")


def _repeated_labels(trials: Iterable[RecordedTrial]) -> Iterator[Fault]:
    """Yield the looks with a label in two slots, where each is in one only."""
    for trial in trials:
        for step, look in enumerate(trial.looks):
            label, times = Counter(filter(None, look.labels)).most_common(1)[0] if any(look.labels) else ("", 0)
            if times > 1:
                yield Fault("repeated label", f"trial {trial.name}, look {step}", f"{label!r} twice; expected it once")


def _odd(kind: str, place: str, what: str) -> Fault:
    return Fault(kind, place, what, fatal=False)


def _still_actions(recording: Recording, used: Iterable[str]) -> Iterator[Fault]:
    """Yield the actions after which the same is seen always: they tell nothing, or are not done."""
    changed, compared = Counter[str](), Counter[str]()
    for trial in recording.trials:
        for before, action, after in zip(trial.looks, trial.actions, trial.looks[1:], strict=False):
            if None not in before.labels and None not in after.labels:
                compared[action] += 1
                changed[action] += before.labels != after.labels
    for action in used:
        if compared[action] >= _COMPARED and not changed[action]:
            yield _odd("still action", "all trials", f"{action!r} never changes what is seen; expected it to, at times")
