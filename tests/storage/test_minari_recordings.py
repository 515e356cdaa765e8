"""Recordings as datasets of Minari, written and read back, and read as anyone reads them."""

import json
from dataclasses import replace

import numpy as np
import pytest

minari = pytest.importorskip("minari", reason="Minari is not installed: pip install atg-fg[minari]")
pytest.importorskip("h5py", reason="h5py is not installed: pip install atg-fg[minari]")
from gymnasium import spaces
from minari.data_collector import EpisodeBuffer

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.object_sense import ObjectSense
from atg_fg.core.recordings import RecordedLook, RecordedTrial, Recording
from atg_fg.storage.minari_recordings import read_minari, write_minari

LOOKS = (
    RecordedLook(("logo", None), (0.9, None)),
    RecordedLook((None, "lid"), (), (None, None), (("weight", 0.25),)),
    RecordedLook((None, "lid"), (), ({"lid": 0.25, "logo": 0.5, "plain": 0.0}, None)),
)
RECORDING = Recording(
    ("front", "top"),
    ("rotate", "tip"),
    ("lid", "logo", "plain"),
    (
        RecordedTrial("größe", LOOKS, ("tip", "rotate"), "cup"),
        RecordedTrial("t1", LOOKS[:2], ("tip",)),
    ),
    n_objects=4,
    n_aspects=3,
    exclusive=True,
    place="looks.jsonl",
    senses=(ObjectSense("size", 1.0, 1.0, 0.5), "weight"),
)


@pytest.fixture(autouse=True)
def datasets(tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path / "datasets"))
    return tmp_path / "datasets"


def plainly(recording):
    """All that a recording says, whatever stands for nothing."""
    return replace(
        recording,
        place="",
        trials=tuple(
            trial._replace(
                looks=tuple(
                    RecordedLook(
                        look.labels,
                        look.confidences if any(sure is not None for sure in look.confidences) else (),
                        look.weights if any(look.weights) else (),
                        look.measured,
                    )
                    for look in trial.looks
                )
            )
            for trial in recording.trials
        ),
    )


def test_what_was_written_is_read_back():
    write_minari(RECORDING, "robot/looks-v0")
    assert plainly(read_minari("robot/looks-v0")) == plainly(RECORDING)


def test_anyone_reads_looks_as_worlds_give_them(datasets):
    folder, left_out = write_minari(RECORDING, "robot/looks-v0")
    assert (folder, left_out) == (datasets / "robot" / "looks-v0", 0)
    dataset = minari.load_dataset("robot/looks-v0")
    assert dataset.spec.observation_space == spaces.Box(-1, 2, (2,), np.int64)
    assert dataset.spec.action_space == spaces.Discrete(2)
    first, second = dataset.iterate_episodes()
    np.testing.assert_array_equal(first.observations, [[1, -1], [-1, 0], [-1, 0]])
    assert first.actions.tolist() == [1, 0]
    assert first.rewards.tolist() == [0.0, 0.0]
    assert first.truncations.tolist() == [False, True]
    assert not first.terminations.any()
    np.testing.assert_array_equal(first.infos["confidence"], [[0.9, np.nan], [np.nan, np.nan], [np.nan, np.nan]])
    np.testing.assert_array_equal(first.infos["likelihood"][2, 0], [0.25, 0.5, 0.0])
    assert np.isnan(first.infos["likelihood"][2, 1]).all()
    np.testing.assert_array_equal(first.infos["measured"], [[np.nan, np.nan], [np.nan, 0.25], [np.nan, np.nan]])
    assert len(second) == 1
    assert json.loads(dataset.storage.metadata["atg_fg"])["labels"] == ["lid", "logo", "plain"]


def test_a_trial_without_an_action_is_left_out_and_counted():
    one_look = RecordedTrial("short", LOOKS[:1], ())
    recording = replace(RECORDING, trials=(one_look, *RECORDING.trials))
    assert write_minari(recording, "robot/looks-v0")[1] == 1
    assert plainly(read_minari("robot/looks-v0")) == plainly(RECORDING)
    with pytest.raises(InvalidInputError, match=r"looks\.jsonl: no trial with an action"):
        write_minari(replace(RECORDING, trials=(one_look,)), "robot/short-v0")


@pytest.mark.parametrize("name", ["", "looks", "../looks-v0", "a b-v0", "looks-v0/.."])
def test_a_name_that_is_none_is_refused_and_nothing_written(datasets, name):
    with pytest.raises(InvalidInputError, match=r"dataset .*; expected a name such as robot/looks-v0"):
        write_minari(RECORDING, name)
    assert not datasets.exists() or not list(datasets.iterdir())


def test_what_is_there_is_not_written_over():
    write_minari(RECORDING, "looks-v0")
    with pytest.raises(InvalidInputError, match=r"looks-v0: there is such a dataset in .*; expected another name"):
        write_minari(replace(RECORDING, trials=RECORDING.trials[:1]), "looks-v0")
    assert len(read_minari("looks-v0").trials) == 2


def test_nothing_is_left_of_a_dataset_that_could_not_be_written(datasets, monkeypatch):
    def full(*_):
        raise OSError("no space left on device")

    monkeypatch.setattr("minari.dataset.minari_storage.MinariStorage.update_metadata", full)
    with pytest.raises(OSError, match="no space left"):
        write_minari(RECORDING, "looks-v0")
    assert list(datasets.iterdir()) == []


def from_elsewhere(name, observations, space, actions=(0, 1), n_actions=2, **metadata):
    episode = EpisodeBuffer(
        id=0,
        observations=np.array(observations),
        actions=np.array(actions),
        rewards=[1.0, 0.0],
        terminations=[False, True],
        truncations=[False, False],
        infos=metadata.pop("infos", {}),
    )
    dataset = minari.create_dataset_from_buffers(
        name, [episode], observation_space=space, action_space=spaces.Discrete(n_actions)
    )
    dataset.storage.update_metadata(metadata)


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize(
    ("observations", "space"),
    [
        ([0, 2, 1], spaces.Discrete(3)),
        ([[0], [2], [1]], spaces.MultiDiscrete([3])),
        ([[0], [2], [1]], spaces.Box(0, 2, (1,), np.int64)),
    ],
)
def test_a_dataset_from_elsewhere_goes_by_numbers(observations, space):
    from_elsewhere("grid/walk-v0", observations, space)
    recording = read_minari("grid/walk-v0")
    assert (recording.slots, recording.actions) == (("slot-0",), ("action-0", "action-1"))
    assert recording.labels == ("0", "1", "2")
    (trial,) = recording.trials
    assert (trial.name, trial.actions) == ("0", ("action-0", "action-1"))
    assert [look.labels for look in trial.looks] == [("0",), ("2",), ("1",)]


HEADER = {"format": "atg-fg/recording", "version": 1, "slots": ["a"], "actions": ["x", "y"], "labels": ["p", "q", "r"]}


@pytest.mark.filterwarnings("ignore::UserWarning")
@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"space": spaces.Box(-1.0, 1.0, (1,))}, r"expected whole numbers in slots, and numbered actions"),
        ({"atg_fg": "[]"}, "walk-v0: atg_fg: .*; expected an object"),
        ({"atg_fg": "{"}, "walk-v0: atg_fg"),
        ({"atg_fg": json.dumps({**HEADER, "labels": ["p"]})}, "episode 0: observations from 0 to 2; expected -1 to 0"),
        ({"atg_fg": json.dumps({**HEADER, "actions": ["x"]})}, "episode 0: actions from 0 to 1; expected 0 to 0"),
        ({"atg_fg": json.dumps({**HEADER, "slots": ["a", "b"]})}, "expected an entry for each of a, b"),
        ({"atg_fg": json.dumps({**HEADER, "slots": [7]})}, "slots"),
        (
            {"atg_fg": json.dumps(HEADER), "infos": {"confidence": np.ones((3, 2))}},
            r"confidence of shape \(3, 2\); expected numbers of shape \(3, 1\)",
        ),
        ({"atg_fg": json.dumps(HEADER), "infos": {"confidence": np.full((3, 1), 7.0)}}, "confidences: 7.0"),
    ],
)
def test_a_dataset_that_is_no_recording_is_refused_in_one_line(given, message):
    space = given.pop("space", spaces.Box(-1, 2, (1,), np.int64))
    observations = np.zeros((3, 1), np.float32) if space.dtype == np.float32 else [[0], [2], [1]]
    from_elsewhere("walk-v0", observations, space, **given)
    with pytest.raises(InvalidInputError, match=message) as refused:
        read_minari("walk-v0")
    assert "\n" not in str(refused.value)


def test_a_dataset_of_very_many_steps_is_refused_before_it_is_read(monkeypatch):
    write_minari(RECORDING, "looks-v0")
    monkeypatch.setattr("atg_fg.storage.minari_recordings.MAX_STEPS", 2)
    monkeypatch.setattr("minari.dataset.minari_dataset.MinariDataset.iterate_episodes", None)
    with pytest.raises(InvalidInputError, match="looks-v0: 3 steps; expected at most 2"):
        read_minari("looks-v0")


def test_a_dataset_that_is_not_there_or_damaged_is_refused(datasets):
    with pytest.raises(InvalidInputError, match="nothing-v0: no such dataset here"):
        read_minari("nothing-v0")
    folder, _ = write_minari(RECORDING, "looks-v0")
    (folder / "data" / "main_data.hdf5").write_bytes(b"broken")
    with pytest.raises(InvalidInputError, match=r"looks-v0: cannot be read: .*; expected a dataset of Minari"):
        read_minari("looks-v0")
    (folder / "data" / "metadata.json").write_text("{")
    with pytest.raises(InvalidInputError, match="looks-v0: cannot be read"):
        read_minari("looks-v0")
