"""What a page says of kinds of objects."""

import numpy as np
import pytest

from atg_fg.report.kinds import told_kind, told_kinds
from atg_fg.report.page import page
from atg_fg.report.reading import read_report
from atg_fg.storage.memory_files import save_memory
from tests.learning.test_object_kinds import memory

__all__ = ["memory"]  # a fixture


@pytest.fixture(scope="module")
def robot(memory, tmp_path_factory):
    """A database of the memory, and of a trial with it, whose object was a new cube."""
    file = tmp_path_factory.mktemp("kinds") / "robot.db"
    save_memory(memory, file)
    return file


def test_a_page_says_which_kinds_there_are_and_of_which_each_object_is(memory, robot, run):
    kept = ("--memory", robot, "--save-memory", robot, "--record", robot.with_suffix(".jsonl"))
    assert run("trial", *kept, "--preset", "learned", "--actions", "6", "--seed", "3")[0] == 0
    report = read_report(robot)
    cubes = next(note for note in report.notes if "6 places, 24 poses" in note)
    assert cubes.startswith("A kind of 7 objects")
    assert "object-000" in cubes
    assert any("uncertain actions" in note for note in report.notes)
    (trial,) = report.trials
    (note,) = trial.notes
    assert note.startswith("object-018 is a thing like these 7: 6 places, 24 poses, with probability")
    assert "a thing like these 7" in page(report)
    alone = read_report(robot.with_suffix(".jsonl"), memory)
    assert alone.notes == told_kinds(memory)


def test_a_memory_without_trials_shows_its_kinds_beside_its_graphs(memory, tmp_path):
    file = tmp_path / "gallery.db"
    save_memory(memory, file)
    assert read_report(file).notes == told_kinds(memory)


def test_where_nothing_is_known_of_kinds_nothing_is_said(trial, memory):
    plain, _ = trial
    assert told_kinds(plain) == told_kinds(None) == ()
    assert told_kind(plain, plain.names[0]) == told_kind(memory, None) == told_kind(memory, "nobody") == ()
    assert np.isclose(float(told_kind(memory, memory.names[0])[0].rstrip(".").split()[-1]), 1.0)
