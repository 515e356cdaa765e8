from xml.etree import ElementTree

import numpy as np
import pybullet
import pytest

from atg_fg.core.errors import InvalidInputError
from sim.bodies.prepared_robot import HOME_POSTURE, like_the_shell
from sim.bodies.robot import RobotBody
from sim.bodies.robot_mapping import RobotMapping, shell_mapping
from sim.bodies.robot_model import BASE, fitted, model_urdf
from sim.bodies.urdf_reader import read_urdf
from tests.sim import descriptions
from tests.sim.descriptions import joint, written

WRIST = "r2/left_arm/wrist/yaw"


def model_of(tree, folder, mapping=None):
    return fitted(read_urdf(written(tree, folder)), mapping or shell_mapping())


def same_kinematics(one, other):
    np.testing.assert_allclose(one.positions, other.positions, atol=1e-9)
    np.testing.assert_allclose(one.axes, other.axes, atol=1e-9)
    np.testing.assert_allclose(one.lower, other.lower)
    np.testing.assert_allclose(one.upper, other.upper)


def hands_in_pybullet(robot, angles):
    """Place and rotation of both wrists' last links, as PyBullet has them."""
    robot.reset(angles)
    states = [
        pybullet.getLinkState(robot.body, hand, computeForwardKinematics=1, physicsClientId=robot.client)[4:6]
        for hand in robot.arm_joints[6::7]
    ]
    return [[*place, *pybullet.getMatrixFromQuaternion(turn)] for place, turn in states]


def test_a_leading_slash_in_a_name_does_not_matter(client, kinematics, tmp_path):
    robot = like_the_shell(written(descriptions.slashed(descriptions.parsed()), tmp_path))
    same_kinematics(robot.kinematics, kinematics)
    assert set(RobotBody(client, robot).joints) == set(shell_mapping().moved)


def test_a_robot_that_lies_on_its_side_is_stood_upright(kinematics, tmp_path):
    robot = like_the_shell(written(descriptions.mounted(descriptions.parsed()), tmp_path))
    same_kinematics(robot.kinematics, kinematics)


def test_a_robot_that_lies_on_its_side_has_its_hands_and_eye_where_the_shell_has_them(client, tmp_path):
    own = RobotBody(client, like_the_shell(written(descriptions.mounted(descriptions.parsed()), tmp_path)))
    shell = RobotBody(client)
    rng = np.random.default_rng(0)
    for angles in (HOME_POSTURE, *rng.uniform(shell.kinematics.lower, shell.kinematics.upper, (10, 2, 7))):
        np.testing.assert_allclose(hands_in_pybullet(own, angles), hands_in_pybullet(shell, angles), atol=1e-6)
        np.testing.assert_allclose(own.kinematics.hands(angles).pad, shell.kinematics.hands(angles).pad, atol=1e-9)
    np.testing.assert_allclose(own.eye(), shell.eye(), atol=1e-6)


def test_how_the_frames_of_links_are_turned_does_not_matter(client, kinematics, tmp_path):
    names = "r2/left_arm/joint3", "r2/left_arm/joint4"
    path = written(descriptions.with_a_turned_frame(descriptions.parsed(), *names), tmp_path)
    robot = like_the_shell(path)
    same_kinematics(robot.kinematics, kinematics)
    angles = HOME_POSTURE - 0.1
    own, shell = RobotBody(client, robot), RobotBody(client)
    np.testing.assert_allclose(hands_in_pybullet(own, angles), hands_in_pybullet(shell, angles), atol=1e-6)


def test_joints_that_are_not_needed_do_not_matter(kinematics, tmp_path):
    tree = descriptions.parsed()
    finger = ElementTree.SubElement(tree, "joint", name="r2/left_arm/hand/thumb/joint0", type="revolute")
    ElementTree.SubElement(finger, "parent", link=f"{WRIST}_link")
    ElementTree.SubElement(finger, "child", link="thumb")
    ElementTree.SubElement(tree, "link", name="thumb")
    same_kinematics(like_the_shell(written(tree, tmp_path)).kinematics, kinematics)


def test_up_is_where_the_shoulders_are_whichever_way_the_waist_turns(kinematics, tmp_path):
    tree = descriptions.with_a_flipped_waist(descriptions.parsed())
    assert joint(tree, "r2/waist/joint0").find("axis").get("xyz") == "0 0 -1"
    same_kinematics(like_the_shell(written(tree, tmp_path)).kinematics, kinematics)


def test_signs_and_limits_of_joints_are_the_files_own(kinematics, tmp_path):
    names = ("r2/right_arm/joint0", "r2/right_arm/joint2", "r2/right_arm/joint4", "r2/right_arm/wrist/yaw")
    tree = descriptions.with_turned_axes(descriptions.parsed(), *names)
    own = like_the_shell(written(tree, tmp_path)).kinematics
    sign = np.ones((2, 7))
    sign[1, [0, 2, 4, 6]] = -1
    np.testing.assert_allclose(own.axes, sign[..., None] * kinematics.axes, atol=1e-9)
    np.testing.assert_allclose(own.lower[1, 2], -kinematics.upper[1, 2])
    np.testing.assert_allclose(own.hands(sign * HOME_POSTURE).pad, kinematics.hands(HOME_POSTURE).pad, atol=1e-9)


def test_what_hangs_on_a_joint_is_one_link_with_all_their_mass(tmp_path):
    """A weight of 2 kg on a fixed joint, 0.4 m beyond the forearm's own centre of mass."""
    tree = descriptions.parsed()
    alone = model_of(tree, tmp_path).joints["r2/left_arm/joint4"].link
    link = ElementTree.SubElement(tree, "link", name="weight")
    inertial = ElementTree.SubElement(link, "inertial")
    ElementTree.SubElement(inertial, "mass", value="2")
    ElementTree.SubElement(inertial, "inertia", ixx="0.01", iyy="0.01", izz="0.01")
    fixed = ElementTree.SubElement(tree, "joint", name="screw", type="fixed")
    ElementTree.SubElement(fixed, "parent", link="r2/left_arm/joint4_link")
    ElementTree.SubElement(fixed, "child", link="weight")
    aside = np.array([0.4, 0.0, 0.0])
    place = alone.centre + aside
    ElementTree.SubElement(fixed, "origin", xyz=descriptions.text(place))
    both = model_of(tree, tmp_path).joints["r2/left_arm/joint4"].link
    share = 2.0 / (alone.mass + 2.0)
    assert both.mass == pytest.approx(alone.mass + 2.0)
    np.testing.assert_allclose(both.centre, alone.centre + share * aside)
    reduced = alone.mass * share  # of two masses 0.4 m apart, about their common centre
    gained = 0.01 + reduced * 0.4**2 * np.array([0, 1, 1])
    np.testing.assert_allclose(np.diag(both.inertia - alone.inertia), gained, atol=1e-9)


def test_token_masses_and_inertias_are_raised_and_that_is_noted(tmp_path):
    tree = descriptions.with_token_masses(descriptions.parsed(), "r2/left_arm/wrist/pitch_link", f"{WRIST}_link")
    model = model_of(tree, tmp_path)
    for name, rotor in (("r2/left_arm/wrist/pitch", 0.03), (WRIST, 0.03)):
        link = model.joints[name].link
        assert link.mass == 0.3
        np.testing.assert_allclose(np.linalg.eigvalsh(link.inertia), rotor)
    (note,) = model.notes
    assert "token masses" in note
    assert note.endswith(f"in what hangs on r2/left_arm/wrist/pitch, {WRIST}")


def test_an_inertia_that_no_body_can_have_is_mended(tmp_path):
    tree = descriptions.parsed()
    (link,) = (link for link in tree.iter("link") if link.get("name") == f"{WRIST}_link")
    for name, moment in (("ixx", "0.074"), ("iyy", "0.180"), ("izz", "0.0001")):
        link.find("inertial/inertia").set(name, moment)
    moments = np.linalg.eigvalsh(model_of(tree, tmp_path).joints[WRIST].link.inertia)
    assert moments[0] + moments[1] >= moments[2] - 1e-12


def test_other_joints_are_held_where_the_mapping_says_within_their_limits(tmp_path):
    tree = descriptions.parsed()
    for name, upper in (("r2/left_arm/hand/index/proximal", 2.0), ("r2/left_arm/hand/index/medial", 0.7), ("leg", 2.0)):
        descriptions.hung(tree, name, f"{WRIST}_link", "revolute", upper)
    walked = fitted(read_urdf(written(tree, tmp_path)), shell_mapping()).joints[WRIST].link
    turned = [np.arccos((np.trace(piece.pose[:3, :3]) - 1) / 2) for piece in walked.touched[-3:]]
    assert sorted(turned) == pytest.approx([0.0, 0.7, 1.5])


def test_a_robot_with_more_joints_than_pybullet_takes_is_loaded(client, tmp_path):
    tree = descriptions.parsed()
    for number in range(150):
        descriptions.hung(tree, f"extra {number}", "base", "revolute", 1.0)
    robot = RobotBody(client, like_the_shell(written(tree, tmp_path)))
    assert pybullet.getNumJoints(robot.body, physicsClientId=client) == len(shell_mapping().moved)


@pytest.mark.parametrize("joints_a_leg", [7, 80])
def test_legs_are_a_part_of_the_base_however_many_joints_they_have(client, kinematics, tmp_path, joints_a_leg):
    path = written(descriptions.with_legs(descriptions.parsed(), joints_a_leg), tmp_path)
    robot = like_the_shell(path)
    same_kinematics(robot.kinematics, kinematics)
    assert not robot.notes  # token masses of what is fixed weigh nothing
    body = RobotBody(client, robot)
    assert set(body.joints) == set(shell_mapping().moved)
    balls = [shape for shape in pybullet.getCollisionShapeData(body.body, -1, client) if shape[3] == (0.005,) * 3]
    assert len(balls) == 2 * (joints_a_leg + 2)
    shell = RobotBody(client)
    np.testing.assert_allclose(body.gravity_torques(HOME_POSTURE), shell.gravity_torques(HOME_POSTURE), atol=1e-6)


def test_joints_of_a_legged_robot_have_the_files_own_limits_and_tokens_raised(kinematics, tmp_path):
    """Descriptions differ from each other in all of this at once."""
    tree = descriptions.with_legs(descriptions.like_nasas())
    model = model_of(tree, tmp_path)
    own = like_the_shell(tmp_path / "own.urdf").kinematics
    sign = np.ones((2, 7))
    sign[1, [0, 2, 4, 6]] = -1
    np.testing.assert_allclose(own.hands(sign * HOME_POSTURE).pad, kinematics.hands(HOME_POSTURE).pad, atol=1e-9)
    for side, arm in enumerate(model.mapping.arms):
        stated = [joint(tree, name).find("limit") for name in arm]
        assert own.lower[side].tolist() == [float(limit.get("lower")) for limit in stated]
        assert own.upper[side].tolist() == [float(limit.get("upper")) for limit in stated]
        assert all(model.joints[name].link.mass >= 0.3 for name in arm)
    (note,) = model.notes
    assert "wrist/pitch" in note
    assert "_leg/" not in note


def test_pybullet_has_the_links_where_the_file_has_them(client, tmp_path):
    model = model_of(descriptions.mounted(descriptions.parsed()), tmp_path)
    path = tmp_path / "model.urdf"
    path.write_text(model_urdf(model))
    flags = pybullet.URDF_USE_INERTIA_FROM_FILE
    body = pybullet.loadURDF(str(path), useFixedBase=True, flags=flags, physicsClientId=client)
    infos = [pybullet.getJointInfo(body, index, physicsClientId=client) for index in range(len(model.joints))]
    assert {info[1].decode() for info in infos} == model.joints.keys()
    for index, frame in ((info[0], model.joints[info[1].decode()]) for info in infos):
        state = pybullet.getLinkState(body, index, computeForwardKinematics=1, physicsClientId=client)
        np.testing.assert_allclose(state[4], frame.position, atol=1e-6)
        np.testing.assert_allclose(state[0], frame.position + frame.link.centre, atol=1e-6)
        assert frame.parent == BASE or frame.parent in model.joints
        kilograms, _, moments, *_ = pybullet.getDynamicsInfo(body, index, physicsClientId=client)
        assert kilograms == pytest.approx(frame.link.mass)
        np.testing.assert_allclose(sorted(moments), np.linalg.eigvalsh(frame.link.inertia), rtol=1e-6)


def refused(tree, folder, message, mapping=None):
    path = written(tree, folder)
    with pytest.raises(InvalidInputError, match=message) as caught:
        fitted(read_urdf(path), mapping or shell_mapping())
    assert str(caught.value).startswith(f"{path}: ")


@pytest.mark.parametrize("missing", [[WRIST], ["r2/left_arm/joint1", "r2/right_arm/joint3"], ["r2/waist/joint0"]])
def test_all_joints_that_are_missing_are_named(tmp_path, missing):
    tree = descriptions.parsed()
    for name in missing:
        joint(tree, name).set("name", f"{name} (another)")
    refused(tree, tmp_path, f"has no joint {', '.join(missing)}; expected the joint names of NASA's")


def test_joints_that_cannot_be_an_arms_are_refused(tmp_path):
    for kind, message in (("prismatic", "is prismatic, not one that turns"), ("fixed", "is fixed, not one that turns")):
        tree = descriptions.parsed()
        joint(tree, WRIST).set("type", kind)
        refused(tree, tmp_path, message)
    tree = descriptions.parsed()
    joint(tree, WRIST).find("limit").set("upper", "-3")
    refused(tree, tmp_path, f"joint {WRIST} is limited to -0.75 to -3.0")


def test_arms_whose_joints_are_out_of_order_are_refused(tmp_path):
    arms = shell_mapping().arms
    mixed = RobotMapping((arms[0][::-1], arms[1]), shell_mapping().forward, shell_mapping().palm)
    refused(descriptions.parsed(), tmp_path, "does not hang on joint", mixed)


def test_a_robot_whose_shoulders_are_one_above_the_other_is_refused(tmp_path):
    tree = descriptions.parsed()
    joint(tree, "r2/right_arm/joint0").find("origin").set("xyz", "-0.0255 0.0944 0.9")
    refused(tree, tmp_path, "its shoulders are not beside each other")
