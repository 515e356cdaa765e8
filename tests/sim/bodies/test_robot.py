from xml.etree import ElementTree

import numpy as np
import pybullet
import pytest

from atg_fg.core.errors import InvalidInputError
from sim.bodies.cube import CUBE_CENTRE
from sim.bodies.prepared_robot import HOME_POSTURE, like_the_shell
from sim.bodies.robonaut_joints import SIDES, arm, arm_joint_names
from sim.bodies.robot import RobotBody
from sim.manipulation.inverse_kinematics import HandTask, solve
from sim.manipulation.waypoints import INWARD
from tests.sim import descriptions
from tests.sim.descriptions import joint, written

LEFT_ARM, RIGHT_ARM = HOME_POSTURE


def touching(robot, left, right):
    """Pairs of bodies' parts that touch with the arms in a posture: trunk with head, left, right."""
    robot.reset(np.array([left, right]))
    pybullet.performCollisionDetection(physicsClientId=robot.client)
    parts = {robot.joints[name]: side for side in SIDES for name in arm_joint_names(side)}
    parts[-1] = "trunk"
    points = pybullet.getContactPoints(robot.body, robot.body, physicsClientId=robot.client)
    return {frozenset((parts[point[3]], parts[point[4]])) for point in points}


def test_the_eye_looks_at_the_cube(robot):
    eye, direction = robot.eye()
    assert np.linalg.norm(direction) == pytest.approx(1)
    along = (CUBE_CENTRE - eye) @ direction
    assert along > 0.3
    assert np.linalg.norm(CUBE_CENTRE - eye - along * direction) < 0.03
    assert eye[2] > CUBE_CENTRE[2] + 0.14
    assert eye[1] == pytest.approx(0, abs=1e-6)


def test_the_arms_begin_at_home_and_at_rest(robot):
    angles, speeds = robot.state()
    np.testing.assert_array_equal(angles, HOME_POSTURE)
    assert not speeds.any()


def test_at_home_the_robot_does_not_touch_itself(robot):
    assert touching(robot, LEFT_ARM, RIGHT_ARM) == set()
    assert not robot.touches_itself()


def test_an_arm_swung_into_the_torso_is_noticed(robot):
    folded = np.array([0.41, -1.51, -0.43, -2.48, 1.52, -0.75, -0.38])
    assert touching(robot, folded, RIGHT_ARM) == {frozenset(("left", "trunk"))}
    assert robot.touches_itself()
    assert touching(robot, LEFT_ARM, folded) == {frozenset(("right", "trunk"))}
    assert robot.touches_itself()


def test_hands_that_meet_are_noticed(robot):
    for apart, meet in ((0.12, False), (0.08, True)):
        pad = CUBE_CENTRE - apart / 2 * INWARD
        solution = solve(robot.kinematics, HandTask(pad, INWARD, 0.9), HOME_POSTURE, HOME_POSTURE)
        assert solution.reaches()
        # The pads are balls of 5 cm.
        assert touching(robot, *solution.angles) == ({frozenset(SIDES)} if meet else set())
        assert robot.touches_itself() == meet


def test_every_torque_turns_its_own_joint_its_own_way(robot):
    pybullet.setGravity(0, 0, 0, physicsClientId=robot.client)
    for side in range(2):
        for number in range(7):
            robot.reset(HOME_POSTURE)
            torques = np.zeros((2, 7))
            torques[side, number] = 2.0
            robot.apply(torques)
            pybullet.stepSimulation(physicsClientId=robot.client)
            angles, speeds = robot.state()
            assert speeds[side, number] > 0.001
            assert angles[side, number] > HOME_POSTURE[side, number]
            # The other arm is shaken a little, by the waist.
            assert np.abs(speeds[1 - side]).max() < 0.01 * speeds[side, number]


def test_a_torque_lasts_one_step(robot):
    pybullet.setGravity(0, 0, 0, physicsClientId=robot.client)
    robot.apply(np.full((2, 7), 1.0))
    pybullet.stepSimulation(physicsClientId=robot.client)
    first = robot.state()[1]
    for _ in range(10):
        pybullet.stepSimulation(physicsClientId=robot.client)
    assert (np.abs(robot.state()[1]) <= np.abs(first) * 1.05 + 1e-6).all()


def potential_energy(robot, angles):
    """Of the whole robot in the world's gravity, J."""
    robot.reset(angles)
    energy = 0.0
    for link in range(pybullet.getNumJoints(robot.body, physicsClientId=robot.client)):
        mass = pybullet.getDynamicsInfo(robot.body, link, physicsClientId=robot.client)[0]
        state = pybullet.getLinkState(robot.body, link, computeForwardKinematics=1, physicsClientId=robot.client)
        energy += mass * 9.81 * state[0][2]
    return energy


def slopes_of_potential_energy(robot, angles):
    slopes = np.zeros((2, 7))
    for number in np.ndindex(2, 7):
        change = np.zeros((2, 7))
        change[number] = 1e-3
        slopes[number] = (potential_energy(robot, angles + change) - potential_energy(robot, angles - change)) / 2e-3
    return slopes


def test_what_holds_the_arms_against_gravity_is_the_slope_of_their_potential_energy(robot):
    rng = np.random.default_rng(0)
    for angles in (HOME_POSTURE, *rng.uniform(robot.kinematics.lower, robot.kinematics.upper, (3, 2, 7))):
        expected = slopes_of_potential_energy(robot, angles)
        np.testing.assert_allclose(robot.gravity_torques(angles), expected, atol=1e-3)


def test_gravity_is_known_to_a_robot_whose_file_has_it_lie_on_its_side(client, tmp_path):
    robot = RobotBody(client, like_the_shell(written(descriptions.mounted(descriptions.parsed()), tmp_path)))
    expected = slopes_of_potential_energy(robot, HOME_POSTURE)
    np.testing.assert_allclose(robot.gravity_torques(HOME_POSTURE), expected, atol=1e-3)


def test_gravity_pulls_on_both_arms_alike(robot):
    left, right = robot.gravity_torques(HOME_POSTURE)
    np.testing.assert_allclose(left, right, atol=1e-6)
    assert np.abs(left).max() > 5


def test_nothing_is_needed_to_hold_the_arms_without_gravity(robot):
    pybullet.setGravity(0, 0, 0, physicsClientId=robot.client)
    np.testing.assert_allclose(robot.gravity_torques(HOME_POSTURE), 0, atol=1e-9)


def test_torques_and_speeds_are_limited_as_in_the_table(robot):
    assert robot.effort.tolist() == [[joint.effort for joint in arm(side)] for side in SIDES]
    assert robot.velocity.tolist() == [[joint.velocity for joint in arm(side)] for side in SIDES]


def test_lower_limits_of_a_file_win_and_higher_ones_do_not(client, tmp_path):
    tree = descriptions.parsed()
    joint(tree, "r2/left_arm/joint3").find("limit").set("effort", "12.5")
    joint(tree, "r2/right_arm/joint0").find("limit").set("velocity", "0.75")
    joint(tree, "r2/right_arm/joint1").find("limit").set("effort", "5000")
    joint(tree, "r2/right_arm/joint2").find("limit").set("velocity", "900")
    # A token value, as descriptions have it for what nobody measured.
    joint(tree, "r2/right_arm/joint3").find("limit").set("effort", "0")
    robot = RobotBody(client, like_the_shell(written(tree, tmp_path)))
    effort = np.array([[joint.effort for joint in arm(side)] for side in SIDES])
    velocity = np.array([[joint.velocity for joint in arm(side)] for side in SIDES])
    effort[0, 3], velocity[1, 0] = 12.5, 0.75
    assert robot.effort.tolist() == effort.tolist()
    assert robot.velocity.tolist() == velocity.tolist()


def test_pads_get_the_friction_that_is_asked_for_and_nothing_else_does(robot):
    robot.set_pad_friction(0.37, 0.011)
    hands = set(robot.hands)
    for link in range(pybullet.getNumJoints(robot.body, physicsClientId=robot.client)):
        info = pybullet.getDynamicsInfo(robot.body, link, physicsClientId=robot.client)
        assert ((info[1], info[7]) == (pytest.approx(0.37), pytest.approx(0.011))) == (link in hands)


def test_a_hand_is_the_wrists_last_link(robot):
    assert robot.hands == tuple(robot.joints[arm_joint_names(side)[-1]] for side in SIDES)


@pytest.mark.parametrize("side", [0, 1])
def test_the_force_of_a_contact_is_told_for_the_hand_that_touches(robot, side):
    place = robot.kinematics.hands(HOME_POSTURE).pad[side] - [0, 0, 0.05 + 0.02 - 0.001]
    shape = pybullet.createCollisionShape(pybullet.GEOM_BOX, halfExtents=[0.02] * 3, physicsClientId=robot.client)
    box = pybullet.createMultiBody(0, shape, basePosition=place.tolist(), physicsClientId=robot.client)
    # The arms fall: one hand lands on the box.
    pybullet.stepSimulation(physicsClientId=robot.client)
    forces = robot.contact_forces(box)
    assert forces[side] > 0
    assert forces[1 - side] == 0


def test_a_robot_without_its_meshes_is_refused(client, tmp_path):
    tree = descriptions.parsed()
    for mesh in tree.iter("mesh"):
        mesh.set("filename", "package://robot/lost.stl")
    path = written(tree, tmp_path)
    with pytest.raises(InvalidInputError, match=r"lost\.stl' is no file in the folders about it") as caught:
        like_the_shell(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_meshes_named_by_their_package_are_found_in_the_folders_about_the_file(client, tmp_path):
    package = tmp_path / "own_robot"
    for folder in ("urdf", "meshes"):
        (package / folder).mkdir(parents=True)
    tree = descriptions.parsed()
    for mesh in tree.iter("mesh"):
        mesh.set("filename", f"package://own_robot/meshes/{mesh.get('filename')}")
    path = written(tree, package / "urdf")
    for mesh in path.parent.glob("*.obj"):
        mesh.rename(package / "meshes" / mesh.name)
    robot = RobotBody(client, like_the_shell(path))
    assert robot.state()[0].tolist() == HOME_POSTURE.tolist()


def test_links_may_overlap_about_their_joint(client, tmp_path):
    tree = descriptions.parsed()
    (forearm,) = (link for link in tree.iter("link") if link.get("name") == "r2/left_arm/joint4_link")
    geometry = ElementTree.SubElement(ElementTree.SubElement(forearm, "collision"), "geometry")
    # The upper arm ends 9 cm from the forearm's joint.
    ElementTree.SubElement(geometry, "sphere", radius="0.12")
    assert touching(RobotBody(client, like_the_shell(written(tree, tmp_path))), LEFT_ARM, RIGHT_ARM) == set()
