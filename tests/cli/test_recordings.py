"""Recordings of a user's own on the command line: looked at, learned from, recognised, shown."""

import json
import sqlite3
import sys
from contextlib import closing
from itertools import pairwise

import numpy as np
import pytest

from atg_fg.storage.database.connection import open_to_write
from atg_fg.storage.memory_files import load_memory

LABELS = ("logo", "text", "barcode", "lid", "base", "seal", "plain", "window")


def cups(trials, seed, wrong=0.0):
    """Return trials of three boxes: rotate goes round four sides, tip to the lid and the base."""
    rng = np.random.default_rng(seed)
    objects = [[0, 1, 2, 1, 3, 4], [5, 5, 6, 0, 7, 2], [7, 3, 6, 6, 1, 0]]
    rows = ["trial,step,action,label,label:confidence,object"]
    for trial in range(trials):
        kind, place = int(rng.integers(3)), int(rng.integers(6))
        for step in range(7):
            label = LABELS[int(rng.integers(8)) if rng.random() < wrong else objects[kind][place]]
            action = ("rotate", "tip")[int(rng.integers(2))]
            rows.append(f"t{trial},{step},{action if step < 6 else ''},{label},0.9,box-{kind}")
            if action == "rotate":
                place = (place + 1) % 4 if place < 4 else place
            else:
                place = {0: 4, 1: 4, 2: 4, 3: 4, 4: 5, 5: 0}[place]
    return "\n".join(rows) + "\n"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "first.csv").write_text(cups(24, 1))
    (tmp_path / "second.csv").write_text(cups(8, 2))
    return tmp_path


def document(run, *arguments):
    status, output, error = run(*arguments, "--json", "-")
    assert (status, error) == (0, "")
    return json.loads(output)


def test_what_was_learned_unsupervised_recognises_what_comes_next(run, folder):
    learned = document(run, "learn", "first.csv", "--memory", "robot.db", "--objects", "3", "--aspects", "6")
    assert learned["trials"] == 24
    assert 2 <= len(learned["objects"]) <= 4
    found = document(run, "recognise", "second.csv", "--memory", "robot.db", "--report", "page.html")
    assert found["command"] == "recognise"
    assert [trial["trial"] for trial in found["trials"]] == [f"t{number}" for number in range(8)]
    trial = found["trials"][0]
    assert set(trial) >= {"trial", "verdict", "matched", "object", "steps"}
    assert trial["steps"][0]["seen"]["label"] in LABELS
    assert len(trial["steps"]) == 7
    assert trial["steps"][0]["action"] in ("rotate", "tip")
    for step in trial["steps"]:
        assert abs(step["unseen"] + sum(step["objects"].values()) - 1) < 1e-9
    success = found["score"]["success"]
    assert set(success) == {"count", "of", "rate", "interval95"}
    assert success["of"] == 8
    assert success["rate"] >= 0.7
    assert "barcode" in (folder / "page.html").read_text()
    assert len(load_memory(folder / "robot.db")) == len(learned["objects"])  # nothing was learned
    told = run("memory", "structure", "robot.db")[1].splitlines()
    assert told[0] == "robot.db: no learned structure: looks err, see below"
    assert told[1].startswith("looks err: ")


@pytest.mark.parametrize("left", ["", "CREATE TABLE t (x); DROP TABLE t", None], ids=("nothing", "no table", "no rows"))
def test_what_a_writer_that_had_no_room_left_is_a_new_memory(run, folder, left):
    if left is None:
        open_to_write("robot.db", create=True).close()
    else:
        with closing(sqlite3.connect("robot.db")) as connection:
            connection.executescript(left)
    usual = ("--preset", "default")
    document(run, "learn", "second.csv", "--memory", "robot.db", "--objects", "3", *usual)
    assert len(load_memory("robot.db")) > 0


def test_an_empty_memory_is_begun_and_each_trial_learned_before_the_next(run, folder):
    found = document(
        run, "recognise", "first.csv", "--memory", "robot.json", "--learn", "--objects", "3", "--preset", "default"
    )
    assert found["trials"][0]["verdict"] == "novel"
    assert found["trials"][0]["learned"] == "object-000"
    assert found["score"]["success"]["rate"] >= 0.7
    assert load_memory(folder / "robot.json").names


def weighed(text, seed):
    """Return a recording in which boxes 1 and 2 look like box 0, and only weigh something else."""
    rng, weights = np.random.default_rng(seed), {"box-0": 0.3, "box-1": 0.6, "box-2": 1.2}
    rows, turned = [row.split(",") for row in text.splitlines()], {}
    header, twins = rows.pop(0), [row.copy() for row in rows if row[5] == "box-0"]
    rows = [[f"{name}{row[0]}", *row[1:5], name] for name in weights for row in twins]
    for row in rows:
        row[4] = "" if row[1] == "0" else f"{weights[row[5]] * np.exp(rng.normal(0.0, 0.08)):.4f}"
        turned.setdefault(row[0], []).append(",".join(row))
    order = rng.permutation(len(turned))
    shuffled = [row for number in order for row in list(turned.values())[number]]
    return "\n".join([",".join([*header[:4], "weight:reading", "object"]), *shuffled]) + "\n"


def test_boxes_that_look_alike_are_told_apart_by_weight(run, refused, folder):
    (folder / "weighed.csv").write_text(weighed(cups(30, 1), 3))
    usual = ("--preset", "default")
    found = document(run, "recognise", "weighed.csv", "--memory", "robot.db", "--learn", "--objects", "3", *usual)
    count = found["score"]["success"]
    assert count["count"] >= 0.9 * count["of"]
    first, second = found["trials"][0]["steps"][:2]
    assert "measured" not in first
    assert set(second["measured"]) == {"weight"}
    memory = load_memory("robot.db")
    assert sorted(round(graph.measured["weight"].total / graph.measured["weight"].count, 1) for graph in memory) == [
        pytest.approx(np.log(weight), abs=0.1) for weight in (0.3, 0.6, 1.2)
    ]
    run("recordings", "convert", "weighed.csv", "-o", "weighed.jsonl", "--objects", "3")
    again = document(run, "recognise", "weighed.jsonl", "--memory", "again.db", "--learn", *usual)
    assert again["score"] == found["score"]
    # Looks alone cannot tell them apart.
    columns = [row.split(",") for row in (folder / "weighed.csv").read_text().splitlines()]
    (folder / "seen.csv").write_text("\n".join(",".join([*row[:4], row[5]]) for row in columns) + "\n")
    unfelt = document(run, "recognise", "seen.csv", "--memory", "seen.db", "--learn", "--objects", "3", *usual)
    assert unfelt["score"]["success"]["count"] < count["count"]
    assert document(run, "recognise", "seen.csv", "--memory", "robot.db", *usual)["score"] is not None
    message = refused("recognise", "weighed.csv", "--memory", "seen.db")
    assert "weighed.csv: readings of 'weight'; expected none, as the memory was begun without" in message


def test_taught_objects_have_their_names(run, folder):
    usual = ("--preset", "default")
    document(run, "learn", "first.csv", "--memory", "robot.db", "--teach", "--objects", "3", *usual)
    memory = load_memory(folder / "robot.db")
    assert set(memory.names) == {"box-0", "box-1", "box-2"}
    assert memory.assumptions.alphabet.names == tuple(sorted(LABELS))
    found = document(run, "recognise", "second.csv", "--memory", "robot.db", *usual)
    assert found["score"]["success"]["rate"] >= 0.8
    assert {trial["matched"] for trial in found["trials"]} <= {"box-0", "box-1", "box-2", None}


def test_all_trials_can_be_of_one_named_object(run, folder):
    for name in ("cup", "cup"):
        document(
            run, "learn", "second.csv", "--memory", "m.json", "--name", name, "--objects", "3", "--preset", "default"
        )
    assert load_memory(folder / "m.json").names == ("cup",)


def test_a_label_never_met_before_is_added(run, folder):
    document(run, "learn", "first.csv", "--memory", "robot.db", "--teach", "--objects", "3", "--preset", "default")
    (folder / "new.csv").write_text((folder / "second.csv").read_text().replace("seal", "sticker"))
    document(run, "recognise", "new.csv", "--memory", "robot.db")
    assert "sticker" not in load_memory(folder / "robot.db").assumptions.alphabet.names
    document(run, "learn", "new.csv", "--memory", "robot.db", "--teach", "--preset", "default")
    memory = load_memory(folder / "robot.db")
    assert memory.assumptions.alphabet.names == (*sorted(LABELS), "sticker")
    assert len(memory) == 3


def test_the_check_says_what_is_in_it_and_what_is_odd(run, folder):
    status, output, error = run("recordings", "check", "first.csv")
    assert (status, error) == (0, "")
    assert "actions: rotate, tip" in output
    assert "24 trials, 168 looks" in output
    assert "nothing odd" in output
    found = document(run, "recordings", "check", "first.csv", "--objects", "2")
    assert [each["kind"] for each in found["odd"]] == ["more objects"]
    (folder / "bad.csv").write_text((folder / "first.csv").read_text().replace("0.9", "9", 1))
    status, output, error = run("recordings", "check", "bad.csv")
    assert (status, error) == (1, "")
    assert "fault, no probability: line 2, column 'label:confidence': '9'; expected a number from 0 to 1" in output


def test_a_recording_is_converted_there_and_back(run, folder):
    run("recordings", "convert", "first.csv", "-o", "first.jsonl", "--objects", "3")
    run("recordings", "convert", "first.jsonl", "-o", "again.csv")
    assert (folder / "again.csv").read_text() == (folder / "first.csv").read_text()
    assert json.loads((folder / "first.jsonl").read_text().split("\n")[0])["objects"] == 3


def test_a_recording_goes_to_minari_and_back(run, refused, folder, monkeypatch):
    pytest.importorskip("h5py", reason="Minari is not installed: pip install atg-fg[minari]")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(folder / "datasets"))
    status, output, _ = run("recordings", "export", "first.csv", "--to", "minari", "--name", "robot/cups-v0")
    assert (status, output.splitlines()) == (0, [f"saved: {folder / 'datasets' / 'robot' / 'cups-v0'}"])
    run("recordings", "convert", "robot/cups-v0", "--from", "minari", "-o", "again.csv")
    assert (folder / "again.csv").read_text() == (folder / "first.csv").read_text()
    assert "there is such a dataset" in refused("recordings", "export", "first.csv", "--name", "robot/cups-v0")


def test_without_minari_its_extra_is_named(refused, folder, monkeypatch):
    monkeypatch.setitem(sys.modules, "h5py", None)
    for arguments in (
        ["export", "first.csv", "--name", "a-v0"],
        ["convert", "a-v0", "--from", "minari", "-o", "a.csv"],
    ):
        assert refused("recordings", *arguments).endswith('expected it from: pip install "atg-fg[minari]"\n')


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["learn", "first.csv", "--memory", "m.json"], "first.csv: does not say how many objects there are"),
        (["recognise", "first.csv", "--memory", "m.json"], "m.json: no such file; expected a memory, or --learn"),
        (["learn", "first.csv", "--memory", "m.json", "--objects", "3", "--labels", "logo"], "expected one of: logo"),
        (
            ["learn", "first.csv", "--memory", "m.json", "--objects", "3", "--slots", "side"],
            "no column for slot 'side'",
        ),
        (["learn", "nowhere.csv", "--memory", "m.json"], "nowhere.csv: cannot be read"),
        (["learn", "first.csv", "--memory", "first.csv", "--objects", "3"], "would be overwritten"),
    ],
)
def test_what_does_not_fit_is_one_line(refused, folder, arguments, message):
    assert message in refused(*arguments)
    assert sorted(path.name for path in folder.iterdir()) == ["first.csv", "second.csv"]


def test_a_memory_of_numbers_takes_no_labels(run, refused, folder):
    run("memory", "example", "cubes.json")
    assert "slots label; expected those of the memory: front, top" in refused(
        "recognise", "first.csv", "--memory", "cubes.json"
    )


def test_more_atgs_than_objects_are_warned_of(run, folder):
    arguments = ("learn", "first.csv", "--memory", "m.json", "--teach", "--objects", "2", "--preset", "default")
    assert any("3 ATGs, but n_objects is 2" in warning for warning in document(run, *arguments)["warnings"])


def test_an_action_that_never_changes_anything_is_warned_of(run, folder):
    rows = [row.split(",") for row in (folder / "first.csv").read_text().splitlines()]
    for before, after in pairwise(rows):
        if before[2] == "tip":
            after[3] = before[3]
    (folder / "still.csv").write_text("\n".join(map(",".join, rows)) + "\n")
    arguments = ("learn", "still.csv", "--memory", "m.json", "--teach", "--objects", "3", "--preset", "default")
    (warning,) = document(run, *arguments)["warnings"]
    assert warning == "still.csv: 'tip' never changes what is seen; expected it to, at times"


@pytest.mark.parametrize("memory", ["robot.db", "robot.json"])
def test_of_recordings_that_cannot_all_be_taught_none_is(run, refused, folder, memory):
    (folder / "unnamed.csv").write_text((folder / "second.csv").read_text().replace("box-2", ""))
    teach = ("--teach", "--preset", "default")
    for files in (["first.csv", "unnamed.csv"], ["unnamed.csv"]):
        message = refused("learn", *files, "--memory", memory, "--objects", "3", *teach)
        assert "unnamed.csv: trial t0: no object; expected one, to be taught" in message
        assert not (folder / memory).exists()
    run("learn", "first.csv", "--memory", memory, "--objects", "3", *teach)
    before = load_memory(memory)
    (folder / "twice.jsonl").write_text(
        '{"format": "atg-fg/recording", "version": 1, "slots": ["label"]}\n'
        '{"trial": "a", "object": "new", "actions": ["tip"], "looks": [["new"], ["logo"]]}\n'
        '{"trial": "b", "object": "new", "actions": ["tip"], "looks": [["new"], ["logo"]], '
        '"measured": [{"weight": 1}, null]}\n'
    )
    assert "readings of 'weight'" in refused("learn", "twice.jsonl", "--memory", memory, *teach)
    after = load_memory(memory)
    assert (after.assumptions, after.names) == (before.assumptions, before.names)


def test_labels_that_cannot_be_seen_at_once_are_found_before_anything_is_learned(run, refused, folder):
    rows = "trial,step,action,front,top\na,0,tip,x,y\na,1,,y,x\nb,0,tip,x,y\nb,1,,x,x\n"
    (folder / "two.csv").write_text(rows)
    message = refused("learn", "two.csv", "--memory", "m.db", "--objects", "2", "--exclusive")
    assert "two.csv: trial b, step 1: detection, slot 'top': symbol 0 is repeated" in message
    assert not (folder / "m.db").exists()
    run("recordings", "convert", "two.csv", "-o", "two.jsonl", "--exclusive")
    status, output, _ = run("recordings", "check", "two.jsonl")
    assert status == 1
    assert "fault, repeated label: trial b, look 1: 'x' twice; expected it once" in output


def test_what_a_file_cannot_hold_is_said_before_the_work(refused, folder, monkeypatch):
    monkeypatch.setattr("atg_fg.experiments.recorded_trials.learn", None)
    assert "m.npz: merges or a learned structure" in refused(
        "learn", "first.csv", "--memory", "m.npz", "--objects", "3"
    )
    assert "is a folder" in refused("learn", "first.csv", "--memory", "m.db", "--objects", "3", "--json", "")


def test_trials_whose_object_is_not_told_are_left_out_of_the_score(run, folder):
    run("learn", "first.csv", "--memory", "robot.db", "--teach", "--objects", "3", "--preset", "default")
    rows = (folder / "second.csv").read_text()
    whole = document(run, "recognise", "second.csv", "--memory", "robot.db", "--preset", "default")
    (folder / "part.csv").write_text(rows.replace("box-2", ""))
    found = document(run, "recognise", "part.csv", "--memory", "robot.db", "--preset", "default")
    known = [trial["right"] for trial in whole["trials"] if trial["object"] != "box-2"]
    assert [trial["right"] for trial in found["trials"] if trial["object"] is not None] == known
    assert {trial["right"] for trial in found["trials"] if trial["object"] is None} == {None}
    assert (found["score"]["success"]["count"], found["score"]["success"]["of"]) == (sum(known), len(known))


def test_a_number_of_objects_other_than_the_memory_s_is_warned_of(run, folder):
    run("learn", "first.csv", "--memory", "robot.db", "--teach", "--objects", "3", "--preset", "default")
    arguments = ("recognise", "second.csv", "--memory", "robot.db", "--objects", "5", "--preset", "default")
    (warning,) = document(run, *arguments)["warnings"]
    assert warning == "second.csv: 5 objects; the memory was begun for 3, which counts"
