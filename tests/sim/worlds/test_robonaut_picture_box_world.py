"""The robot with boxes without tags: it finds them by depth, sees what the rendered world shows, and weighs them."""

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.experiments.table1 import TestPlan, run_test
from atg_fg.storage.recorded_header import read_header
from atg_fg.worlds.arcube import SUCCESSORS
from atg_fg.worlds.registry import make_world, make_world_with
from atg_fg.worlds.testing import check_world
from sim.bodies.cube import CUBE_SIZE
from sim.vision.image_noise import Imaging
from sim.worlds.domain_randomization import Condition
from sim.worlds.robonaut_picture_box_world import RobonautPictureBoxWorld

FLIP, LEFT, RIGHT = (np.int64(action) for action in range(3))


@pytest.fixture
def make():
    made = []

    def maker(**options):
        made.append(RobonautPictureBoxWorld(12, 3, **options))
        return made[-1]

    yield maker
    for world in made:
        world.close()


@pytest.fixture(scope="module")
def world():
    made = RobonautPictureBoxWorld(12, 3)
    yield made
    made.close()


def condition(**changes):
    usual = {"cube_mass": (0.8, 0.8), "pad_friction": (1.2, 1.2), "pad_patch": (0.03, 0.03)}
    return Condition("a test", **{**usual, "largest_lean": 0.0, "imaging": Imaging(), **changes})


def off_the_truth(world):
    """Return how far the box that was found is off the one that is there: m, and degrees about the vertical."""
    position, rotation = world.scene.cube_pose()
    level = rotation[:, np.abs(rotation[2]).argmin()]
    yaw = (world.box.yaw - np.arctan2(level[1], level[0]) + np.pi / 4) % (np.pi / 2) - np.pi / 4
    return float(np.linalg.norm(world.box.centre - position)), abs(float(np.degrees(yaw)))


@pytest.mark.parametrize("action", [FLIP, LEFT, RIGHT], ids=["flip", "left", "right"])
def test_an_action_brings_the_box_to_the_next_orientation_and_depth_finds_it(world, action):
    _, before = world.reset(seed=int(action), options={"object": 2, "orientation": 5})
    observation, _, lost, truncated, info = world.step(action)
    assert info["orientation"] == SUCCESSORS[before["orientation"]][action]
    assert (info["right"], info["slipped"], lost, truncated) == (True, False, False, False)
    assert (info["angle_error"], info["position_error"]) < (3, 0.012)
    assert observation["seen"].tolist() == [1, 1]
    position, yaw = off_the_truth(world)
    assert position < 0.006
    assert yaw < 1.0
    assert np.abs(world.box.size - CUBE_SIZE).max() < 0.012
    assert world.scene.self_contacts == 0


@pytest.mark.slow
@pytest.mark.parametrize("weight", [False, True])
def test_trials_can_be_run_in_it(make, weight):
    assert check_world(make(weight=weight), trials=1, steps=2) == 3


def test_its_spaces_are_those_of_the_rendered_world(world):
    with make_world_with("picture-box", 12, 3) as rendered:
        assert world.observation_space == rendered.observation_space
        assert world.action_space == rendered.action_space
        assert world.assumptions == rendered.get_wrapper_attr("assumptions")


@pytest.mark.slow
def test_what_it_sees_is_what_the_rendered_world_shows(world):
    rendered = make_world_with("picture-box", 12, 3).unwrapped
    assert world.sense == rendered.sense
    encode = world.sense.space.encode
    same, other = [], []
    for number in range(8):
        options = {"object": number, "orientation": 3 * number}
        ours, info = world.reset(seed=number, options=options)
        theirs, _ = rendered.reset(seed=number, options=options)
        front, top = (encode(features) for features in ours["appearance"])
        same += [np.linalg.norm(front - encode(theirs["appearance"][0]))]
        same += [np.linalg.norm(top - encode(theirs["appearance"][1]))]
        if len(set(info["pattern"])) == 2:
            other += [np.linalg.norm(front - top)]
    assert np.max(same) < 0.5 * np.min(other)


def test_a_box_off_its_place_is_found_and_brought_back(world):
    world.reset(seed=5, options={"position": (0.44, -0.02)})
    assert off_the_truth(world)[0] < 0.006
    *_, info = world.step(RIGHT)
    assert info["right"]
    assert info["position_error"] < 0.012


@pytest.mark.slow
def test_a_state_that_was_kept_replays_bit_for_bit(make):
    world = make()
    world.reset(seed=4)
    world.step(FLIP)
    kept = world.save()
    first = [world.step(action) for action in (FLIP, LEFT)]
    weighed = world.weighed
    world.restore(kept)
    again = [world.step(action) for action in (FLIP, LEFT)]
    for (one, *_, truth), (other, *_, same_truth) in zip(first, again, strict=True):
        assert (one["appearance"] == other["appearance"]).all()
        assert truth == same_truth
    assert world.weighed == weighed


def test_a_flip_weighs_the_box_and_other_actions_do_not(make):
    world = make()
    for mass in (0.4, 1.6):
        world.condition = condition(cube_mass=(mass, mass))
        world.reset(seed=1)
        assert world.weighed is None
        *_, info = world.step(FLIP)
        assert info["mass"] == mass
        assert world.weighed == pytest.approx(mass, abs=0.15)
        world.step(LEFT)
        assert world.weighed is None


def test_the_weight_of_a_box_is_felt_after_a_flip_where_it_is_asked_for(make):
    world = make(weight=True)
    (sense,) = world.assumptions.object_senses
    assert (sense.name, sense.unit, sense.revealed_by) == ("weight", "kg", ("flip",))
    observation, info = world.reset(seed=2)
    assert info["mass"] == world.boxes.weights[info["object"]]
    assert observation["measured"].tolist() == [0]
    observation, *_, info = world.step(FLIP)
    assert world.observation_space.contains(observation)
    assert observation["measured"].tolist() == [1]
    assert abs(observation["weight"][0] - info["mass"]) < 4 * sense.error
    observation, *_ = world.step(LEFT)
    assert observation["measured"].tolist() == [0]


def test_without_depth_nothing_is_seen_and_the_robot_goes_by_where_the_box_should_be(make, monkeypatch):
    world = make()
    nothing = np.zeros((300, 400), dtype=np.float32)
    monkeypatch.setattr("sim.vision.image_noise.noisy_depth", lambda *_: nothing)
    observation, _ = world.reset(seed=1)
    assert observation["seen"].tolist() == [0, 0]
    assert (observation["appearance"] == 0).all()
    *_, info = world.step(FLIP)
    assert info["right"]


def test_what_has_not_the_size_of_a_box_is_none(make, monkeypatch):
    world = make()
    monkeypatch.setattr("sim.worlds.robonaut_picture_box_world.CUBE_SIZE", 0.2)
    observation, _ = world.reset(seed=1)
    assert observation["seen"].tolist() == [0, 0]
    assert world.box is None


def test_pictures_show_what_was_found(make):
    world = make(render_mode="detections")
    world.reset(seed=1)
    plain = world.frame
    picture = world.render()
    assert picture.shape == (300, 400 + 150, 3)
    assert (picture[:, :400] != plain).any()


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"look_alikes": 2.0}, InvalidInputError, "look_alikes: 2.0; expected a probability"),
        ({"weight": "yes"}, InvalidInputError, "weight: 'yes'; expected true or false"),
        ({"features": "sift"}, InvalidInputError, "features: 'sift'"),
        ({"condition": "broken"}, UnknownNameError, "broken"),
        ({"render_mode": "human"}, UnknownNameError, "human"),
        ({"image_size": (4, 4)}, InvalidInputError, "image_size"),
        ({"image_size": 400}, InvalidInputError, "image_size: 400; expected width and height"),
    ],
)
def test_options_of_nonsense_are_refused(options, error, message):
    with pytest.raises(error, match=message):
        make_world("robonaut-picture-box", **options)


def test_a_record_that_names_a_robot_has_it_not_loaded(tmp_path):
    options = {"urdf": str(tmp_path / "nowhere.urdf"), "features": "mine:embed", "condition": "worn"}
    header = {"seed": 0, "world": "robonaut-picture-box", "n_objects": 7, "world_options": options}
    assumptions = read_header(header, "test.jsonl.gz")[1]
    assert (assumptions.n_objects, assumptions.alphabet.slots) == (7, ("front", "top"))


@pytest.mark.slow
def test_a_short_test_on_the_robot_recognises_boxes(tmp_path):
    plan = TestPlan(world="robonaut-picture-box", engine="bayes-filter", n_trials=6, n_actions=4, n_objects=3)
    whole = run_test(plan, 0, records=tmp_path)
    assert run_test(plan, 0, records=tmp_path, resume=True) == whole
