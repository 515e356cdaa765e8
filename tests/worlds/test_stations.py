import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.worlds.arcube import SUCCESSORS, make_arcubes, shown_pattern
from atg_fg.worlds.arcube_world import ARcubeWorld
from atg_fg.worlds.stations import AtStation, StationsWorld, make_stations

CUBES = make_arcubes(5, seed=0)


def test_it_keeps_gymnasiums_contract():
    check_env(make_stations("ideal", 2, cubes=CUBES), skip_render_check=True)


def test_each_station_has_an_object_of_its_own_that_stays_as_it_was_left():
    world = make_stations("ideal", 3, cubes=CUBES)
    _, info = world.reset(seed=0, options={"objects": [3, 1, 4], "orientations": [0, 5, 7]})
    assert (info["object"], info["orientation"], info["station"]) == (3, 0, 0)
    observation, _, _, _, info = world.step(np.int64(1))
    assert tuple(observation) == shown_pattern(CUBES[3], SUCCESSORS[0][1])
    observation, _, _, _, info = world.step(np.int64(3 + 2))
    assert (info["object"], info["orientation"], info["station"]) == (4, 7, 2)
    assert tuple(observation) == shown_pattern(CUBES[4], 7)
    _, _, _, _, info = world.step(np.int64(3 + 0))
    assert info["orientation"] == SUCCESSORS[0][1]


def test_objects_drawn_are_all_different_and_alike_for_the_same_seed():
    world = make_stations("ideal", 5, cubes=CUBES)
    views = [AtStation(world, station) for station in range(5)]

    def drawn(seed):
        world.reset(seed=seed)
        truths = [view.reset()[1] for view in views]
        return [(truth["object"], truth["orientation"]) for truth in truths]

    assert sorted(number for number, _ in drawn(0)) == [0, 1, 2, 3, 4]
    assert drawn(0) == drawn(0) != drawn(1)


def test_a_station_is_a_world_of_one_object():
    world = make_stations("ideal", 2, cubes=CUBES)
    world.reset(seed=0, options={"objects": [0, 1]})
    there = AtStation(world, 1)
    _, info = there.reset()
    assert (there.action_space.n, info["object"], info["station"]) == (3, 1, 1)
    _, _, terminated, _, info = there.step(np.int64(2))
    assert info["station"] == 1
    assert not terminated
    with pytest.raises(InvalidInputError, match=r"action: .*3.*; expected 0 to 2"):
        there.step(np.int64(3))


def test_what_cannot_be_is_refused():
    with pytest.raises(InvalidInputError, match="stations: 0"):
        make_stations("ideal", 0)
    with pytest.raises(InvalidInputError, match="stations: none"):
        StationsWorld([])
    with pytest.raises(InvalidInputError, match="5 to draw from; expected at least 6"):
        make_stations("ideal", 6, cubes=CUBES).reset(seed=0)
    world = make_stations("ideal", 2, cubes=CUBES)
    with pytest.raises(InvalidInputError, match=r"'objects': \[1\]; expected one entry for each of 2 stations"):
        world.reset(options={"objects": [1]})
    with pytest.raises(UnknownNameError, match="'object'"):
        world.reset(options={"object": 1})
    with pytest.raises(InvalidInputError, match=r"action: .*5.*; expected 0 to 4"):
        world.step(np.int64(5))
    with pytest.raises(InvalidInputError, match="station: 2; expected 0 to 1"):
        AtStation(world, 2)


def test_one_noisy_world_a_station_takes_the_options_of_the_world():
    world = make_stations("ideal", 2, cubes=CUBES, slip=1.0)
    world.reset(seed=0)
    assert isinstance(world.worlds[1].unwrapped, ARcubeWorld)
    assert world.step(np.int64(0))[4]["slipped"]
