import numpy as np
import pytest

from atg_fg.worlds.arcube import rotation_of
from sim.bodies.cube import CUBE_CENTRE
from sim.manipulation.execution import Manipulator, OutOfReachError
from sim.manipulation.impedance_control import ArmController
from sim.vision.cube_pose import CubePose
from sim.worlds.domain_randomization import Circumstances
from sim.worlds.scene import PlacedCube, Scene

TAGS = (0, 1, 2, 3, 4, 5)
AT_ITS_PLACE = CubePose(CUBE_CENTRE, 0.0)


@pytest.fixture
def scene():
    made = Scene(Circumstances(), [PlacedCube(TAGS, CUBE_CENTRE, rotation_of(0))])
    yield made
    made.close()


def manipulator(scene, look, phases=None):
    on_phase = None if phases is None else phases.append
    return Manipulator(ArmController(scene.robot, scene.advance), look, on_phase)


def test_a_flip_goes_through_its_phases_and_ends_at_home(scene):
    phases, looks = [], []

    def look():
        looks.append(scene.steps)
        return AT_ITS_PLACE

    robot = manipulator(scene, look, phases)
    robot.act("flip")
    assert phases == ["approach", "grasp", "lift", "turn", "put down", "release", "unwind"]
    # Once to take hold, once to see whether it stands square.
    assert len(looks) == 2
    angles, velocities = scene.robot.state()
    np.testing.assert_allclose(angles, robot.controller.reference, atol=0.03)
    assert np.abs(velocities).max() < 0.2


def test_a_turn_looks_again_before_it_changes_hands(scene):
    halfway = []

    def look():
        position, rotation = scene.cube.pose()
        yaw = (np.arctan2(rotation[1, 0], rotation[0, 0]) + np.pi / 4) % (np.pi / 2) - np.pi / 4
        halfway.append(abs(np.degrees(yaw)))
        return CubePose(np.array([*position[:2], CUBE_CENTRE[2]]), yaw)

    manipulator(scene, look).act("right")
    assert halfway[0] < 1
    assert halfway[1] == pytest.approx(45, abs=4)
    assert halfway[2] < 4


def test_the_robot_goes_by_what_it_sees_and_not_by_where_the_cube_is(scene):
    phases = []
    seen = iter([AT_ITS_PLACE, CubePose(CUBE_CENTRE, np.radians(10)), AT_ITS_PLACE])
    manipulator(scene, lambda: next(seen), phases).act("flip")
    assert "slide" in phases
    assert next(seen, None) is None


def test_a_cube_that_stands_well_is_not_squared(scene):
    robot = manipulator(scene, lambda: AT_ITS_PLACE)
    robot.act("flip")
    assert robot.squarings == 0


def test_squaring_is_given_up_after_two_tries(scene):
    looks = []

    def look():
        looks.append(1)
        return CubePose(CUBE_CENTRE, np.radians(5))

    robot = manipulator(scene, look)
    robot.act("flip")
    assert robot.squarings == 2
    assert len(looks) == 3


@pytest.mark.parametrize("action", ["flip", "left", "right"])
def test_a_cube_out_of_reach_is_said_to_be(scene, action):
    far = CubePose(np.add(CUBE_CENTRE, [0.5, 0.0, 0.0]), 0.0)
    with pytest.raises(OutOfReachError, match=r"grasp: the cube at x 0\.920, y 0\.000 m is out of reach"):
        manipulator(scene, lambda: far).act(action)
