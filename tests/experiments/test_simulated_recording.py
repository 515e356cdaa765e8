"""Recordings of worlds: the truth is in them, and all is drawn by the seed."""

import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.experiments.simulated_recording import simulated_recording
from atg_fg.storage.recordings import read_recording, write_recording


def test_without_noise_an_object_shows_one_label_in_each_state():
    recording = simulated_recording("detector", 2, 20, 6, seed=0)
    assert (recording.n_objects, recording.n_aspects, recording.exclusive) == (2, 6, False)
    assert {trial.object for trial in recording.trials} == {"object 0", "object 1"}
    for trial in recording.trials:
        assert (len(trial.looks), len(trial.actions)) == (7, 6)
        for before, action, after in zip(trial.looks, trial.actions, trial.looks[1:], strict=False):
            assert before.labels[0] in recording.labels
            assert action in ("rotate", "tip")
            assert after.confidences == ()


def test_noise_and_confidences_are_the_worlds():
    noisy = simulated_recording("detector", 8, 60, 8, seed=1, wrong=0.2, missing=0.1, confidences=True)
    looks = [look for trial in noisy.trials for look in trial.looks]
    missing = [look for look in looks if look.labels == (None,)]
    assert 0.05 < len(missing) / len(looks) < 0.16
    assert all(0.35 <= look.confidences[0] <= 0.98 for look in looks if look.labels != (None,))


def test_the_same_seed_gives_the_same_file(tmp_path):
    for name in ("one.csv", "other.csv"):
        write_recording(simulated_recording("detector", 3, 5, 4, seed=7), tmp_path / name)
    assert (tmp_path / "one.csv").read_bytes() == (tmp_path / "other.csv").read_bytes()
    again, made = read_recording(tmp_path / "one.csv"), simulated_recording("detector", 3, 5, 4, seed=7)
    for read, trial in zip(again.trials, made.trials, strict=True):
        assert [look.labels for look in read.looks] == [look.labels for look in trial.looks]
        assert (read.name, read.actions, read.object) == (trial.name, trial.actions, trial.object)


def test_a_later_recording_can_be_of_the_same_objects():
    def shown(recording):
        return {(trial.object, look.labels) for trial in recording.trials for look in trial.looks}

    first = shown(simulated_recording("detector", 3, 60, 8, seed=1))
    assert shown(simulated_recording("detector", 3, 20, 8, seed=2, objects_seed=1)) <= first
    assert not shown(simulated_recording("detector", 3, 20, 8, seed=2)) <= first


def test_worlds_of_tags_are_recorded_too():
    recording = simulated_recording("ideal", 3, 2, 4, seed=0)
    assert recording.slots == ("front", "top")
    assert recording.exclusive
    assert recording.trials[0].looks[0].labels[0] in recording.labels
    with pytest.raises(InvalidInputError, match="option 'no_such_option': unknown"):
        simulated_recording("ideal", 3, 2, 4, seed=0, no_such_option=1)
