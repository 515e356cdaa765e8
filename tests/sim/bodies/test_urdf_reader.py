from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pybullet
import pytest

from atg_fg.core.errors import InvalidInputError
from sim.bodies.robot import HOME_POSTURE, RobotBody
from sim.bodies.urdf_reader import REQUIRED_JOINTS, read_description
from tests.sim import descriptions
from tests.sim.descriptions import MOUNT_ANGLES, MOUNT_OFFSET, joint, written

WRIST = "r2/left_arm/wrist/yaw"


def same_kinematics(one, other):
    np.testing.assert_allclose(one.positions, other.positions, atol=1e-9)
    np.testing.assert_allclose(one.axes, other.axes, atol=1e-9)
    assert np.array_equal(one.lower, other.lower)
    assert np.array_equal(one.upper, other.upper)


def hands_in_pybullet(robot, angles):
    """Place and rotation of both wrists' last links, as PyBullet has them."""
    robot.reset(angles)
    states = [
        pybullet.getLinkState(robot.body, hand, computeForwardKinematics=1, physicsClientId=robot.client)[4:6]
        for hand in robot.arm_joints[6::7]
    ]
    return [[*place, *pybullet.getMatrixFromQuaternion(turn)] for place, turn in states]


def test_a_leading_slash_in_a_name_does_not_matter(client, kinematics, tmp_path):
    path = written(descriptions.slashed(descriptions.parsed()), tmp_path)
    description = read_description(path)
    assert description.names == {name: f"/{name}" for name in REQUIRED_JOINTS}
    same_kinematics(description.kinematics(), kinematics)
    assert set(RobotBody(client, path).joints) == set(REQUIRED_JOINTS)


def test_a_robot_that_lies_on_its_side_is_stood_upright(kinematics, tmp_path):
    description = read_description(written(descriptions.mounted(descriptions.parsed()), tmp_path))
    same_kinematics(description.kinematics(), kinematics)
    turn = pybullet.getMatrixFromQuaternion(pybullet.getQuaternionFromEuler(MOUNT_ANGLES))
    upright = description.base_rotation @ np.reshape(turn, (3, 3))
    np.testing.assert_allclose(upright, np.eye(3), atol=1e-9)
    np.testing.assert_allclose(description.base_position + description.base_rotation @ MOUNT_OFFSET, 0, atol=1e-9)


def test_a_robot_that_lies_on_its_side_has_its_hands_and_eye_where_the_shell_has_them(client, tmp_path):
    own = RobotBody(client, written(descriptions.mounted(descriptions.parsed()), tmp_path))
    shell = RobotBody(client)
    rng = np.random.default_rng(0)
    for angles in (HOME_POSTURE, *rng.uniform(shell.kinematics.lower, shell.kinematics.upper, (10, 2, 7))):
        np.testing.assert_allclose(hands_in_pybullet(own, angles), hands_in_pybullet(shell, angles), atol=1e-6)
        np.testing.assert_allclose(own.kinematics.hands(angles).pad, shell.kinematics.hands(angles).pad, atol=1e-9)
    np.testing.assert_allclose(own.eye(), shell.eye(), atol=1e-6)


def test_how_the_frames_of_links_are_turned_does_not_matter(client, kinematics, tmp_path):
    names = "r2/left_arm/joint3", "r2/left_arm/joint4"
    path = written(descriptions.with_a_turned_frame(descriptions.parsed(), *names), tmp_path)
    description = read_description(path)
    same_kinematics(description.kinematics(), kinematics)
    assert np.abs(description.joints[names[0]].rotation - np.eye(3)).max() > 0.5
    np.testing.assert_allclose(description.joints[names[1]].rotation, np.eye(3), atol=1e-9)
    angles = HOME_POSTURE - 0.1
    own, shell = RobotBody(client, path), RobotBody(client)
    np.testing.assert_allclose(hands_in_pybullet(own, angles), hands_in_pybullet(shell, angles), atol=1e-6)


def test_joints_that_are_not_needed_do_not_matter(kinematics, tmp_path):
    tree = descriptions.parsed()
    finger = ElementTree.SubElement(tree, "joint", name="r2/left_arm/hand/thumb/joint0", type="revolute")
    ElementTree.SubElement(finger, "parent", link=f"{WRIST}_link")
    ElementTree.SubElement(finger, "child", link="thumb")
    ElementTree.SubElement(tree, "link", name="thumb")
    same_kinematics(read_description(written(tree, tmp_path)).kinematics(), kinematics)


def test_an_axis_need_not_be_a_unit_vector_and_is_x_if_not_told(tmp_path):
    tree = descriptions.parsed()
    joint(tree, WRIST).find("axis").set("xyz", "0 0 -2.5")
    elbow = joint(tree, "r2/left_arm/joint3")
    elbow.remove(elbow.find("axis"))
    joints = read_description(written(tree, tmp_path)).joints
    np.testing.assert_allclose(joints[WRIST].axis, [0, 0, -1], atol=1e-12)
    np.testing.assert_allclose(joints["r2/left_arm/joint3"].axis, [1, 0, 0], atol=1e-12)


def refused(path, message):
    with pytest.raises(InvalidInputError, match=message) as caught:
        read_description(path)
    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize("missing", [[WRIST], ["r2/neck/joint1", "r2/right_arm/joint3"], ["r2/waist/joint0"]])
def test_all_joints_that_are_missing_are_named(tmp_path, missing):
    tree = descriptions.parsed()
    for name in missing:
        joint(tree, name).set("name", "something/else")
    refused(written(tree, tmp_path), f"has no joint {', '.join(missing)}; expected the joint names of NASA's")


def test_a_robot_without_a_joint_is_not_loaded(client, tmp_path):
    tree = descriptions.parsed()
    joint(tree, WRIST).set("name", "something/else")
    with pytest.raises(InvalidInputError, match=f"own.urdf: has no joint {WRIST}"):
        RobotBody(client, written(tree, tmp_path))
    assert pybullet.getNumBodies(physicsClientId=client) == 0


def test_a_file_that_is_not_there_is_refused(tmp_path):
    refused(tmp_path / "nowhere.urdf", "cannot be read as URDF: .*No such file")


def test_a_folder_is_refused(tmp_path):
    refused(tmp_path, "cannot be read as URDF")


@pytest.mark.parametrize("content", ["", "solid cube", "<robot><link></robot>"])
def test_a_file_that_is_not_xml_is_refused(tmp_path, content):
    path = Path(tmp_path / "broken.urdf")
    path.write_text(content)
    refused(path, "cannot be read as URDF: .*; expected a robot's description")


@pytest.mark.parametrize("numbers", ["1 2", "1 2 3 4", "left right up", "0.1, 0.2, 0.3"])
@pytest.mark.parametrize(("element", "attribute"), [("origin", "xyz"), ("origin", "rpy"), ("axis", "xyz")])
def test_a_vector_that_is_not_three_numbers_is_refused(tmp_path, element, attribute, numbers):
    tree = descriptions.parsed()
    joint(tree, WRIST).find(element).set(attribute, numbers)
    refused(written(tree, tmp_path), "three finite numbers|could not convert string to float")


def test_a_joint_without_a_limit_is_refused(tmp_path):
    tree = descriptions.parsed()
    joint(tree, WRIST).remove(joint(tree, WRIST).find("limit"))
    refused(written(tree, tmp_path), f"joint {WRIST} is not revolute with a limit")


def test_a_limit_that_is_not_a_number_is_refused(tmp_path):
    tree = descriptions.parsed()
    joint(tree, WRIST).find("limit").set("upper", "far")
    refused(written(tree, tmp_path), "could not convert string to float: 'far'")


def test_a_joint_that_hangs_on_nothing_is_refused(tmp_path):
    tree = descriptions.parsed()
    joint(tree, WRIST).remove(joint(tree, WRIST).find("parent"))
    refused(written(tree, tmp_path), f"joint {WRIST} has no parent")


def test_joints_that_go_round_in_a_circle_are_refused(tmp_path):
    tree = descriptions.parsed()
    joint(tree, WRIST).find("child").set("link", "base")
    refused(written(tree, tmp_path), "its joints go round in a circle")
