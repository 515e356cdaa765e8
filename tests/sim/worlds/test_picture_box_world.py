"""The world of boxes without tags: what it says, and that classes are found in what its camera sees."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.goals import Goal
from atg_fg.core.memory import RobotMemory
from atg_fg.display.atg_picture import draw_atg
from atg_fg.engines import begin_trial
from atg_fg.experiments.exploration import explore
from atg_fg.experiments.table1 import TestPlan, run_test
from atg_fg.experiments.trial import learn_from, run_trial
from atg_fg.learning.structured_memory import memory_for
from atg_fg.policies import ExplorationPolicy, RandomPolicy
from atg_fg.policies.goal import GoalPolicy
from atg_fg.senses.appearance import AppearanceSense
from atg_fg.storage.memory_files import load_memory, open_memory, save_memory
from atg_fg.storage.presets import preset
from atg_fg.storage.recorded_header import read_header
from atg_fg.worlds.arcube import FRONT, ORIENTATIONS, canonical
from atg_fg.worlds.registry import assumptions_of, make_world_with, sense_of
from atg_fg.worlds.testing import check_world
from sim.bodies.pictures import PLAIN, make_picture_boxes


@pytest.fixture(scope="module")
def world():
    with make_world_with("picture-box", 12, 3) as made:
        yield made


def memory_of(world, structured=False):
    empty = RobotMemory(assumptions_of(world, 12), sense=sense_of(world))
    return memory_for(preset("learned"), empty) if structured else empty


def trials(world, memory, n, seed=0):
    """Let a memory learn from trials of six random actions each; return their records."""
    records = []
    for number in range(n):
        rng = np.random.default_rng((seed, number))
        record = run_trial(world, begin_trial("bayes-filter", memory, preset("default")), RandomPolicy(), 6, rng)
        learn_from(record, memory)
        records.append(record)
    return records


def test_trials_can_be_run_in_it(world):
    assert check_world(world, trials=1, steps=4) == 5
    with make_world_with("picture-box", 4, 3, weight=True) as felt:
        assert check_world(felt, trials=1, steps=4) == 5


def test_boxes_share_pictures_and_no_two_are_the_same_however_they_are_turned():
    boxes = make_picture_boxes(100, 5)
    assert len({canonical(faces) for faces in boxes.faces}) == 100
    shown = Counter(picture for faces in boxes.faces for picture in faces)
    assert 0.19 < shown[PLAIN] / 600 < 0.31
    assert all(count > 1 for count in shown.values())
    alike = make_picture_boxes(40, 5, look_alikes=1.0).faces
    nearest = [
        min(sum(a != b for a, b in zip(ours, theirs, strict=True)) for theirs in alike[:n])
        for n, ours in enumerate(alike)
        if n
    ]
    assert nearest == [1] * 39


def test_a_quarter_turn_of_a_crop_has_the_same_features(world):
    world.reset(seed=1)
    features = world.get_wrapper_attr("features")
    crop = world.get_wrapper_attr("crops")[1]
    turned = features(np.ascontiguousarray(np.rot90(crop)))
    other = features(world.get_wrapper_attr("crops")[0])
    assert np.linalg.norm(turned - features(crop)) < 0.1 * np.linalg.norm(other - features(crop))


@pytest.mark.slow
def test_classes_found_without_labels_are_the_pictures(world):
    memory = memory_of(world)
    records = trials(world, memory, 12)
    found = Counter()
    for record, trial in zip(records, memory.sense.trials, strict=True):
        for step, detection in zip(record.steps, trial.detections, strict=True):
            found.update(zip(detection, step.truth["pattern"], strict=True))
    # Every class is one picture, and nearly every picture one class.
    assert len({symbol for symbol, _ in found}) == len(found)
    assert len(found) <= len({picture for _, picture in found}) + 2


@pytest.mark.parametrize(
    ("name", "structured"),
    [
        ("memory.json", False),
        ("memory.db", True),
        pytest.param("memory.json", True, marks=pytest.mark.slow),
        pytest.param("memory.db", False, marks=pytest.mark.slow),
    ],
)
def test_what_a_memory_knows_of_appearances_is_saved_with_it(world, tmp_path, name, structured):
    memory = memory_of(world, structured)
    trials(world, memory, 3)
    save_memory(memory, tmp_path / name)
    loaded = load_memory(tmp_path / name)
    assert loaded == memory
    for each in (memory, loaded):
        trials(world, each, 1, seed=7)
    assert loaded == memory
    assert loaded.sense.codebook.counts.tolist() == memory.sense.codebook.counts.tolist()


def test_a_memory_in_a_database_goes_on_with_its_classes(world, tmp_path):
    memory = memory_of(world, structured=True)
    save_memory(memory, tmp_path / "memory.db")
    with open_memory(tmp_path / "memory.db") as kept:
        trials(world, memory, 4)
        trials(world, kept, 4)
        assert kept == memory
    assert load_memory(tmp_path / "memory.db") == memory


def test_readings_in_a_record_are_all_that_learning_needs(tmp_path):
    plan = TestPlan(world="picture-box", engine="bayes-filter", n_trials=4, n_actions=3, n_objects=3)
    whole = run_test(plan, 0, memories=tmp_path)
    run_test(plan, 0, records=tmp_path / "records")
    resumed = run_test(plan, 0, records=tmp_path / "records", resume=True, memories=tmp_path / "again")
    assert resumed == whole
    assert load_memory(tmp_path / "again" / "memory-0000.json") == load_memory(tmp_path / "memory-0000.json")


def test_a_memory_of_other_features_or_of_none_is_refused(world):
    without = RobotMemory(assumptions_of(world, 12))
    inference = begin_trial("bayes-filter", without, preset("default"))
    with pytest.raises(InvalidInputError, match="features 'colours-and-gradients', memory without a sense"):
        run_trial(world, inference, RandomPolicy(), 1, np.random.default_rng(0))
    own = sense_of(world)
    other = AppearanceSense(replace(own.space, features="mine:embed"), own.alphabet)
    memory = RobotMemory(assumptions_of(world, 12), sense=other)
    inference = begin_trial("bayes-filter", memory, preset("default"))
    with pytest.raises(InvalidInputError, match="features 'colours-and-gradients', memory of 'mine:embed'"):
        run_trial(world, inference, RandomPolicy(), 1, np.random.default_rng(0))


def test_classes_are_thumbnails_in_pictures_of_atgs(world):
    memory, features = memory_of(world), world.get_wrapper_attr("features")
    trials(world, memory, 4)
    crops, shown = [], {}
    for seed in range(40):
        _, info = world.reset(seed=seed)
        for crop, picture in zip(world.get_wrapper_attr("crops"), info["pattern"], strict=True):
            crops.append(crop.copy())
            shown[id(crops[-1])] = picture
    thumbnails = memory.sense.thumbnails(crops, features)
    assert 4 <= len(thumbnails) <= memory.sense.codebook.n_classes
    # A crop stands for the class that it is of, and no two of them show the same picture.
    assert all(memory.sense.symbol_of(features(crop)) == symbol for symbol, crop in thumbnails.items())
    assert len({shown[id(crop)] for crop in thumbnails.values()}) == len(thumbnails)
    figure = draw_atg(memory["object-000"], symbol_images=thumbnails)
    drawn = [image.get_array() for image in figure.axes[0].get_images()]
    assert drawn
    assert all(any(np.array_equal(array, crop) for crop in thumbnails.values()) for array in drawn)


def test_boxes_that_differ_in_weight_alone_look_the_same():
    boxes = make_picture_boxes(60, 5, look_alikes=0.5, differ_in="weight")
    looks = Counter(boxes.faces)
    assert 20 <= len(looks) <= 40
    assert len(set(boxes.weights.tolist())) == 60
    assert make_picture_boxes(60, 5).faces[0] == boxes.faces[0]


def test_a_weight_is_felt_when_a_box_is_turned_and_learned_with_its_looks():
    with make_world_with("picture-box", 3, 1, weight=True) as felt:
        memory = RobotMemory(assumptions_of(felt, 3), sense=sense_of(felt))
        first, _ = felt.reset(seed=1, options={"object": 2})
        assert felt.observation_space.contains(first)
        assert first["measured"].tolist() == [0]
        second = felt.step(np.int64(0))[0]
        assert felt.observation_space.contains(second)
        true = felt.get_wrapper_attr("boxes").weights[2]
        assert second["weight"][0] == pytest.approx(true, rel=0.35)
        (record,) = trials(felt, memory, 1)
        measured = [step.truth.get("measured") for step in record.steps]
        assert measured[0] is None
        assert all(each["weight"] > 0 for each in measured[1:])
        assert memory["object-000"].measured["weight"].count == 6


def test_a_memory_that_counts_on_weights_is_refused_where_there_are_none(world):
    with make_world_with("picture-box", 12, 3, weight=True) as felt:
        memory = RobotMemory(assumptions_of(felt, 12), sense=sense_of(felt))
        inference = begin_trial("bayes-filter", memory, preset("default"))
        with pytest.raises(InvalidInputError, match="expected readings of it, too: weight, measured"):
            run_trial(world, inference, RandomPolicy(), 1, np.random.default_rng(0))


def test_a_goal_can_be_given_by_a_crop(world):
    memory = memory_of(world)
    explore(memory, world, 2, ExplorationPolicy(), 60, np.random.default_rng(0))
    world.reset(seed=11, options={"object": 1, "orientation": 3})
    wanted = world.get_wrapper_attr("crops")[0]
    symbol = memory.sense.symbol_of(world.get_wrapper_attr("features")(wanted))
    shown = world.get_wrapper_attr("boxes").faces[1]
    goal = Goal.of_slots(memory.assumptions.alphabet, {"front": symbol})
    inference = begin_trial("bayes-filter", memory, preset("default"))
    options = {"object": 1, "orientation": 0}
    record = run_trial(world, inference, GoalPolicy(goal), 20, np.random.default_rng(0), reset_options=options)
    assert record.steps[-1].detection[0] == symbol
    assert record.steps[-1].truth["pattern"][0] == shown[ORIENTATIONS[3][FRONT]]


def test_a_record_that_names_code_for_features_runs_none_of_it(tmp_path, monkeypatch):
    ran = tmp_path / "ran"
    (tmp_path / "mine.py").write_text(f"open({str(ran)!r}, 'w').close()\ndef embed(crop):\n    return [1.0]\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    header = {"seed": 0, "world": "picture-box", "world_options": {"features": "mine:embed"}}
    assumptions = read_header(header, "test.jsonl.gz")[1]
    assert assumptions.alphabet.slots == ("front", "top")
    assert not ran.exists()
