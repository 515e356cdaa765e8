import os
import time

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from sim.bodies.cube import CUBE_CENTRE
from sim.manipulation import preparation
from sim.manipulation.preparation import prepared
from sim.worlds.robonaut_arcube_world import RobonautARcubeWorld
from tests.sim import descriptions
from tests.sim.descriptions import written


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    """A robot whose file is as unlike the shell as NASA's own are."""
    return prepared(written(descriptions.like_nasas(), tmp_path_factory.mktemp("nasa")))


def test_a_robot_with_fists_and_turned_axes_is_made_ready(robot):
    kinematics = robot.kinematics
    for posture in (robot.home, robot.tucked):
        assert (posture >= kinematics.lower).all()
        assert (posture <= kinematics.upper).all()
    home, tucked = (kinematics.hands(posture).pad for posture in (robot.home, robot.tucked))
    np.testing.assert_allclose(home[:, 0], CUBE_CENTRE[0], atol=0.02)
    np.testing.assert_allclose(home[:, 2], CUBE_CENTRE[2], atol=0.02)
    # A tenth of a metre beside the faces, and above all that stands on the table.
    assert (np.abs(home[:, 1]) - kinematics.pad_radius > 0.14 + 0.08).all()
    assert (tucked[:, 2] > 0.44 + 0.1).all()


@pytest.mark.slow
def test_a_robot_as_unlike_the_shell_as_nasas_turns_the_cube(robot):
    world = RobonautARcubeWorld(urdf=robot)
    try:
        observation, info = world.reset(seed=0)
        assert tuple(observation) == info["pattern"]
        for action in (0, 1, 2, 0, 2, 1):
            observation, _, _, _, info = world.step(np.int64(action))
            assert info["right"]
            assert info["peak_force"] < 300
            assert tuple(observation) == info["pattern"]
        assert world.controller.exertion.velocity.max() <= 1
        assert world.scene.self_contacts == 0
    finally:
        world.close()


def test_the_same_file_is_made_ready_once_and_a_changed_one_anew(tmp_path, monkeypatch):
    runs = []
    monkeypatch.setattr(preparation, "_run_examination", lambda urdf, found: runs.append(urdf) or fake(found))

    def fake(found):
        zero = np.zeros((2, 7))
        values = (np.zeros((2, 3)), np.zeros(2), zero, zero, np.array([], dtype=str).reshape(0, 2))
        np.savez(found, **dict(zip(preparation._FOUND, values, strict=True)))

    path = written(descriptions.parsed(), tmp_path)
    assert prepared(path) is prepared(path)
    assert len(runs) == 1
    os.utime(path, ns=(1, 1))
    prepared(path)
    assert len(runs) == 2


def test_what_was_changed_of_the_file_is_told(tmp_path, monkeypatch, caplog):
    monkeypatch.setattr(preparation, "_run_examination", lambda urdf, found: (_ for _ in ()).throw(KeyboardInterrupt))
    tree = descriptions.with_token_masses(descriptions.parsed(), "r2/left_arm/wrist/yaw_link")
    with pytest.raises(KeyboardInterrupt):
        prepared(written(tree, tmp_path))
    assert "token masses" in caplog.text


def test_a_mesh_that_crashes_pybullet_takes_down_no_more_than_its_own_process(tmp_path, capfd):
    path = written(descriptions.parsed(), tmp_path)
    (tmp_path / "ball.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 900000000/1/1\n")
    with pytest.raises(InvalidInputError, match="cannot be loaded") as caught:
        prepared(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert "\n" not in str(caught.value)
    assert capfd.readouterr() == ("", "")


def test_a_robot_that_takes_too_long_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr(preparation, "_TIME_LIMIT", 0.05)
    begun = time.monotonic()
    with pytest.raises(InvalidInputError, match="cannot be loaded: not in 0 s"):
        prepared(written(descriptions.parsed(), tmp_path))
    assert time.monotonic() - begun < 5
