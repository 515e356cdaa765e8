"""What is told to be odd in recordings of a user's own detector."""

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.storage.recording_csv import MOST_FAULTS
from atg_fg.storage.recordings import RecordingSpec, check_recording, read_recording

ODD = "trial,step,action,label,confidence,object\n" + "".join(
    f"{trial},{step},{'' if step == 6 else ('tip', 'rotate')[step % 2]},{'abc'[(step + trial) % 3]},0.5,o{trial}\n"
    for trial in range(4)
    for step in range(7)
)
PLANTED = {
    "unknown label": ("0,1,rotate,b", "0,1,rotate,zebra"),
    "unknown action": ("0,1,rotate", "0,1,kick"),
    "missing step": ("0,1,rotate,b,0.5,o0\n", ""),
    "steps out of order": ("0,2,tip", "0,1,tip"),
    "no probability": ("0,1,rotate,b,0.5", "0,1,rotate,b,7"),
    "no step": ("0,1,rotate", f"0,{'9' * 5000},rotate"),
    "confidence alone": ("0,1,rotate,b,0.5", "0,1,rotate,,0.5"),
    "trial split": ("1,0,tip", "0,0,tip"),
    "two objects": ("0,1,rotate,b,0.5,o0", "0,1,rotate,b,0.5,o9"),
    "no action": ("0,1,rotate", "0,1,"),
    "action at the end": ("0,6,,", "0,6,tip,"),
    "columns": ("0,1,rotate,b,0.5,o0", "0,1,rotate,b"),
    "more objects": ("3,6,", "3,6,"),
}
SPEC = RecordingSpec(labels=("a", "b", "c"), actions=("tip", "rotate"))


@pytest.mark.parametrize("kind", PLANTED)
def test_the_check_finds_what_was_planted(written, kind):
    assert check_recording(written(ODD), SPEC)[1] == []
    spec = SPEC._replace(n_objects=3) if kind == "more objects" else SPEC
    text = ODD.replace(*PLANTED[kind], 1)
    if kind == "trial split":  # the first row of a trial belongs to an earlier one
        text = ODD.replace("2,0,tip", "0,0,tip", 1)
    found = check_recording(written(text), spec)[1]
    assert kind in {fault.kind for fault in found}, found


def test_what_is_odd_in_one_row_is_said_once(written):
    """A gap is no fault of the rows after it, and an action that is not there is none that there is alone."""
    text = ODD.replace("0,1,rotate,b,0.5,o0\n", "", 1)
    assert [str(fault) for fault in check_recording(written(text), SPEC)[1]] == [
        "line 3, column 'step': 2; expected 1, one more than before"
    ]
    found = check_recording(written("trial,step,action,label\na,0,,x\na,1,tip,y\na,2,,x\nb,0,tip,x\nb,1,,y\n"))[1]
    assert [fault.kind for fault in found] == ["no action", "one action"]
    assert "'tip' alone" in str(found[-1])


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        ("one action", lambda line: line.replace("rotate", "tip")),
        ("still action", lambda line: ",".join([*line.split(",")[:3], "a", "0.5", line.split(",")[5]])),
        ("one label", lambda line: ",".join([*line.split(",")[:3], "a", "0.5", line.split(",")[5]])),
        ("one look", lambda line: line if line.startswith(("0", "1", "2")) or line.startswith("3,0") else ""),
        ("nothing seen", lambda line: ",".join([*line.split(",")[:3], "", "", "o3"]) if line[0] == "3" else line),
        ("unused action", lambda line: line.replace("rotate", "tip")),
    ],
)
def test_the_check_finds_what_no_row_shows_by_itself(written, kind, change):
    header, *rows = ODD.splitlines()
    text = "\n".join([header, *filter(None, map(change, rows))]) + "\n"
    assert kind in {fault.kind for fault in check_recording(written(text), SPEC)[1]}


@pytest.mark.parametrize(
    ("kind", "reading"),
    [
        ("one reading", lambda trial, step, error: 0.5),
        ("copied readings", lambda trial, step, error: 0.5 + trial),
        ("far reading", lambda trial, step, error: (0.5 + trial) * (1 + error) * (1000 if trial == step == 3 else 1)),
        ("useless readings", lambda trial, step, error: 0.5 * (1 + error)),
        (None, lambda trial, step, error: (0.5 + trial) * (1 + error)),
    ],
)
def test_the_check_finds_readings_that_tell_no_object_from_another(written, kind, reading):
    rng = np.random.default_rng(0)
    rows = [
        f"{trial},{step},{'' if step == 6 else ('tip', 'rotate')[step % 2]},{'abc'[(step + trial) % 3]},"
        f"{reading(trial, step, rng.normal(0.0, 0.05))}"
        for trial in range(8)
        for step in range(7)
    ]
    found = check_recording(written("\n".join(["trial,step,action,label,weight:reading", *rows, ""])))[1]
    assert [(fault.kind, fault.fatal) for fault in found] == ([] if kind is None else [(kind, False)])


def test_of_many_faults_the_first_are_kept_and_the_first_fatal_one(written):
    rows = [f"{trial},{step},{'go' if step < 2 else 'end'},a" for trial in range(1500) for step in range(3)]
    path = written("\n".join(["trial,step,action,label", *rows, "x,0,,a", "x,1,,a"]) + "\n")
    faults = [fault for fault in check_recording(path)[1] if fault.place.startswith("line")]
    assert len(faults) == MOST_FAULTS + 1
    assert {fault.kind for fault in faults[:-1]} == {"action at the end"}
    with pytest.raises(InvalidInputError, match="line 4502, column 'action': empty"):
        read_recording(path)
