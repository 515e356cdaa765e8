import multiprocessing

import numpy as np
import pybullet
import pytest
from gymnasium.utils.env_checker import check_env

from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.core.patterns import MISSING
from atg_fg.worlds.arcube import rotation_of
from atg_fg.worlds.arcube_world import ARcubeWorld
from atg_fg.worlds.stations import AtStation, StationsWorld, make_stations
from sim.bodies.cube import CUBE_SIZE
from sim.bodies.rail import RAIL_FORCE, RAIL_SPEED
from sim.bodies.tables import TABLE_SIZE
from sim.vision.tag_detection import detect_markers
from sim.worlds.scene import STATION_SPACING
from sim.worlds.stations_world import RobonautTableWorld
from tests.sim import descriptions
from tests.sim.descriptions import written

FLIP, LEFT, RIGHT, FIRST, SECOND, THIRD = (np.int64(action) for action in range(6))
ON_THE_FLOOR = np.array([0.0, 2.0, -0.3])


@pytest.fixture
def make():
    made = []

    def maker(**options):
        made.append(RobonautTableWorld(**options))
        return made[-1]

    yield maker
    for world in made:
        world.close()


@pytest.fixture(scope="module")
def world():
    made = RobonautTableWorld()
    yield made
    made.close()


def fingerprint(world, observation, info):
    """Everything of a step that can be compared bit for bit."""
    poses = [array for cube in world.scene.cubes for array in cube.pose()]
    arrays = (observation, *world.scene.robot.state(), world.scene.robot.place, *poses, world.frame)
    return [array.tobytes() for array in arrays], repr(info)


def history(world, seed, actions):
    observation, info = world.reset(seed=seed)
    prints = [fingerprint(world, observation, info)]
    for action in actions:
        observation, _, _, _, info = world.step(action)
        prints.append(fingerprint(world, observation, info))
    return prints


def lose(world, station):
    """As if somebody took the cube away."""
    world.scene.cubes[station].place(np.add(ON_THE_FLOOR, [0.0, station, 0.0]), rotation_of(0))


def distance(world, bodies):
    """How near the robot is to one of some bodies, m; half a metre if it is farther."""
    client, robot = world.scene.client, world.scene.robot.body
    points = (pybullet.getClosestPoints(robot, body, 0.5, physicsClientId=client) for body in bodies)
    return min((point[8] for found in points for point in found), default=0.5)


@pytest.mark.slow
def test_the_world_keeps_gymnasiums_contract(make):
    check_env(make(n_stations=2, render_mode="rgb_array"), skip_render_check=True)


def test_its_spaces_are_those_of_a_world_at_each_station(world):
    ideal = StationsWorld([ARcubeWorld() for _ in range(3)])
    assert (world.action_space, world.observation_space) == (ideal.action_space, ideal.observation_space)
    assert world.n_stations == ideal.n_stations


def test_the_robot_serves_one_cube_after_the_other_clear_of_their_neighbours(world):
    _, info = world.reset(seed=0, options={"objects": [4, 9, 17], "orientations": [3, 8, 20]})
    assert (info["object"], info["orientation"], info["station"]) == (4, 3, 0)
    nearest, strayed = [], []

    def watch():
        if info["station"] == going_to and world.scene.steps % 24 == 0:
            others = [station for station in range(3) if station != world.scene.station]
            bodies = [body for other in others for body in (world.scene.cubes[other].body, world.scene.tables[other])]
            nearest.append(distance(world, bodies))
            strayed.append(abs(world.scene.robot.rail.position - world.scene.rail_position(world.scene.station)))

    world.scene.on_step = watch
    for action, station, object_ in ((FLIP, 0, 4), (THIRD, 2, 17), (LEFT, 2, 17), (SECOND, 1, 9), (RIGHT, 1, 9)):
        going_to = station
        observation, reward, terminated, truncated, info = world.step(action)
        assert (reward, terminated, truncated) == (0.0, False, False)
        assert (info["station"], info["object"]) == (station, object_)
        assert tuple(observation) == info["pattern"]
        if action < FIRST:
            assert info["right"]
            assert info["orientation"] == info["expected_orientation"]
            assert info["position_error"] < 0.012
    assert min(nearest) > 0.04
    assert max(strayed) < 1e-4
    assert world.scene.self_contacts == 0


def test_a_move_is_clear_of_everything_and_within_the_rails_limits(world):
    world.reset(seed=1)
    nearest = {"cubes": 0.5, "tables": 0.5, "while it slides": 0.5}
    speeds, forces, places = [], [], []

    def watch():
        rail = world.scene.robot.rail
        speeds.append(abs(rail.speed))
        forces.append(abs(rail.force))
        places.append(rail.position)
        if world.scene.steps % 8 == 0:
            cubes = [cube.body for cube in world.scene.cubes]
            nearest["cubes"] = min(nearest["cubes"], distance(world, cubes))
            nearest["tables"] = min(nearest["tables"], distance(world, world.scene.tables))
            if abs(rail.speed) > 0.01:
                everything = [*cubes, *world.scene.tables]
                nearest["while it slides"] = min(nearest["while it slides"], distance(world, everything))

    world.scene.on_step = watch
    before = [cube.pose()[0] for cube in world.scene.cubes]
    for action in (THIRD, SECOND, FIRST):
        world.step(action)
    assert nearest["while it slides"] > 0.12
    assert min(nearest.values()) > 0.04
    assert 0.5 < max(speeds) <= RAIL_SPEED
    assert max(forces) <= 0.5 * RAIL_FORCE
    assert np.ptp(places) == pytest.approx(2 * STATION_SPACING, abs=0.002)
    np.testing.assert_allclose([cube.pose()[0] for cube in world.scene.cubes], before, atol=2e-5)


def test_tables_are_as_wide_as_one_alone_with_room_between(world):
    assert STATION_SPACING - TABLE_SIZE[1] > 0.15
    boxes = [pybullet.getAABB(table, physicsClientId=world.scene.client) for table in world.scene.tables]
    lower, upper = np.array(boxes)[:, 0, 1], np.array(boxes)[:, 1, 1]
    assert (upper - lower < 0.63).all()
    assert (lower[:-1] > upper[1:]).all()


def test_neighbours_tags_are_not_taken_for_those_of_the_cube_here(make):
    """A wide eye sees the neighbours as well; with the cube here taken away, there is nothing to report."""
    world = make(image_size=(1280, 240))
    observation, info = world.reset(seed=0)
    world.step(SECOND)
    seen = detect_markers(world.frame, world.camera)
    others = [marker for marker in seen if abs(marker.behind(CUBE_SIZE / 2)[1]) > STATION_SPACING / 2]
    assert others
    assert len(world.markers) == len(seen) - len(others)
    lose(world, 1)
    observation, _, _, _, info = world.step(SECOND)
    assert detect_markers(world.frame, world.camera)
    assert world.markers == []
    assert observation.tolist() == [MISSING, MISSING]
    assert info["lost"]


def test_a_robot_that_looks_at_the_wrong_place_goes_on(make):
    world = make(n_stations=2)
    world.reset(seed=0)
    world.scene.robot.rail.reset(0.0)
    observation, _, _, _, _ = world.step(FIRST)
    assert observation.tolist() == [MISSING, MISSING]
    # It acts in the air between two tables, and may well knock a cube over.
    for action in (FLIP, SECOND):
        observation, _, _, _, info = world.step(action)
        assert world.observation_space.contains(observation)
    assert info["lost"] == world.scene.has_lost_the_cube(1)


def test_a_lost_cube_stays_lost_and_the_episode_ends_with_the_last_one(make):
    world = make(n_stations=2)
    world.reset(seed=0)
    lose(world, 0)
    observation, _, terminated, _, info = world.step(FLIP)
    assert (terminated, info["lost"], info["right"]) == (False, True, False)
    assert observation.tolist() == [MISSING, MISSING]
    with pytest.raises(InvalidInputError, match="station 0 is lost"):
        world.step(LEFT)
    observation, _, terminated, _, info = world.step(SECOND)
    assert (terminated, info["lost"]) == (False, False)
    assert tuple(observation) == info["pattern"]
    lose(world, 1)
    _, _, terminated, _, info = world.step(FIRST)
    assert (terminated, info["lost"], info["station"]) == (False, True, 0)
    _, _, terminated, _, info = world.step(SECOND)
    assert (terminated, info["lost"], info["station"]) == (True, True, 1)
    _, info = world.reset(seed=0)
    assert not info["lost"]


def test_going_to_a_station_is_a_fresh_look(make):
    world = make(n_stations=2, condition="worn")
    world.reset(seed=3)
    first = world.frame
    steps = world.scene.steps
    _, _, _, _, info = world.step(FIRST)
    assert world.scene.steps == steps
    assert (world.frame != first).any()
    assert info["simulated_seconds"] == 0
    at_second = AtStation(world, 1)
    observation, info = at_second.reset()
    assert (tuple(observation), info["station"]) == (info["pattern"], 1)


def test_a_trial_is_the_same_in_another_process_and_whatever_was_before_it(world):
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        there = pool.apply(_history_elsewhere)
    world.reset(seed=0)
    world.step(THIRD)
    assert there == history(world, 3, [SECOND, FLIP])


def _history_elsewhere():
    world = RobonautTableWorld()
    prints = history(world, 3, [SECOND, FLIP])
    world.close()
    return prints


def test_a_state_that_was_kept_replays_bit_for_bit(make):
    world = make(condition="worn", n_stations=2)
    world.reset(seed=1)
    world.step(SECOND)
    kept = world.save()

    def once(actions):
        prints = []
        for action in actions:
            observation, _, _, _, info = world.step(action)
            prints.append(fingerprint(world, observation, info))
        return prints

    first = once([FLIP, FIRST])
    world.restore(kept)
    assert world.station == 1
    assert once([FLIP, FIRST]) == first


def test_a_users_description_slides_and_acts(make, tmp_path):
    path = written(descriptions.mounted(descriptions.slashed(descriptions.parsed())), tmp_path)
    world = make(n_stations=2, urdf=path)
    world.reset(seed=0)
    observation, _, _, _, info = world.step(SECOND)
    assert tuple(observation) == info["pattern"]
    _, _, _, _, info = world.step(FLIP)
    assert info["right"]
    assert world.scene.robot.place[1] == pytest.approx(-STATION_SPACING / 2, abs=0.001)


def test_one_station_is_the_world_of_one_cube(make):
    world = make(n_stations=1)
    _, info = world.reset(seed=0, options={"objects": [2], "orientations": [5]})
    assert (info["object"], info["orientation"], world.scene.robot.rail) == (2, 5, None)
    assert world.step(FIRST)[4]["station"] == 0
    assert world.action_space.n == 4


def test_a_film_shows_the_robot_go_to_another_station(make):
    world = make(n_stations=2, render_mode="rgb_array_list")
    world.reset(seed=0)
    world.step(SECOND)
    pictures = world.render()
    assert len(pictures) > 5
    assert (np.abs(pictures[0].astype(int) - pictures[-1]).max(axis=2) > 30).mean() > 0.02
    for mode, size in (("rgb_array", pictures[0].shape), ("head", (240, 320, 3)), ("detections", (240, 320, 3))):
        world.render_mode = mode
        assert world.render().shape == size


def test_it_is_what_make_stations_makes_of_the_robot():
    with make_stations("robonaut", 4, condition="worn", render_mode="head") as world:
        assert isinstance(world.unwrapped, RobonautTableWorld)
        assert world.get_wrapper_attr("n_stations") == 4
        assert world.unwrapped.condition.summary.startswith("polished")


@pytest.mark.parametrize("n_stations", [0, 6, 2.5, "two"])
def test_too_few_or_too_many_stations_are_refused(n_stations):
    with pytest.raises(InvalidInputError, match="expected 1 to 5"):
        RobonautTableWorld(n_stations=n_stations)


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"object": 1}, UnknownNameError, "reset option: unknown name 'object'"),
        ({"position": (0.4, 0.0)}, UnknownNameError, "reset option: unknown name 'position'"),
        ({"objects": [1, 2]}, InvalidInputError, "one entry for each of 3 stations"),
        ({"objects": [1, 2, 100]}, InvalidInputError, "'object': 100; expected 0 to 99"),
        ({"orientations": 3}, InvalidInputError, "one entry for each of 3 stations"),
        ({"orientations": [0, 0, 24]}, InvalidInputError, "'orientation': 24; expected 0 to 23"),
    ],
)
def test_bad_reset_options_are_refused(world, options, error, message):
    with pytest.raises(error, match=message):
        world.reset(options=options)


@pytest.mark.parametrize("action", [6, -1, 0.5, None])
def test_only_its_actions_are_taken(world, action):
    world.reset(seed=0)
    with pytest.raises(InvalidInputError, match="expected 0 to 5"):
        world.step(action)


@pytest.mark.slow
def test_random_actions_at_random_stations_come_out_right(world):
    rng = np.random.default_rng(0)
    for seed in range(3):
        world.reset(seed=seed)
        for _ in range(10):
            observation, _, _, _, info = world.step(FIRST + rng.integers(3))
            assert tuple(observation) == info["pattern"]
            observation, _, _, _, info = world.step(rng.integers(3))
            assert info["right"]
            assert tuple(observation) == info["pattern"]
