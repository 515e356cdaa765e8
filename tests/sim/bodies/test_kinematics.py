import numpy as np
import pybullet
import pytest
from hypothesis import given

from sim.bodies.kinematics import cross
from sim.bodies.prepared_robot import HOME_POSTURE
from sim.bodies.robonaut_joints import ARM_AXIS, PAD_OFFSET, SIDES, arm
from tests.sim.postures import MIRROR, shares, within_limits

STEP = 1e-6  # rad


def moved(angles, joint, step):
    changed = angles.copy()
    changed[:, joint] += step
    return changed


@given(shares)
def test_the_jacobian_is_how_the_pads_move_with_the_joints(kinematics, shares):
    angles = within_limits(kinematics, shares)
    jacobian = kinematics.hands(angles).jacobian
    for joint in range(7):
        ahead, behind = (kinematics.hands(moved(angles, joint, step)).pad for step in (STEP, -STEP))
        np.testing.assert_allclose(jacobian[:, :3, joint], (ahead - behind) / (2 * STEP), atol=1e-8)


@given(shares)
def test_the_jacobian_is_how_the_hands_turn_with_the_joints(kinematics, shares):
    angles = within_limits(kinematics, shares)
    hands = kinematics.hands(angles)
    for joint in range(7):
        ahead, behind = (kinematics.hands(moved(angles, joint, step)).rotation for step in (STEP, -STEP))
        spin = (ahead - behind) / (2 * STEP) @ hands.rotation.transpose(0, 2, 1)
        np.testing.assert_allclose(spin, -spin.transpose(0, 2, 1), atol=1e-8)
        rate = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
        np.testing.assert_allclose(hands.jacobian[:, 3:, joint], rate, atol=1e-8)


@given(shares)
def test_equal_angles_in_both_arms_give_mirror_images(kinematics, shares):
    angles = within_limits(kinematics, np.stack([shares[0]] * 2))
    hands = kinematics.hands(angles)
    for left, right in (hands.pad, hands.axis, hands.palm):
        np.testing.assert_allclose(right, MIRROR @ left, atol=1e-12)
    np.testing.assert_allclose(hands.rotation[1], MIRROR @ hands.rotation[0] @ MIRROR, atol=1e-12)
    np.testing.assert_allclose(hands.joints[1], hands.joints[0] @ MIRROR, atol=1e-12)


@given(shares)
def test_a_hand_is_a_rigid_body(kinematics, shares):
    hands = kinematics.hands(within_limits(kinematics, shares))
    np.testing.assert_allclose(hands.rotation @ hands.rotation.transpose(0, 2, 1), [np.eye(3)] * 2, atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(hands.rotation), 1, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(hands.axis, axis=1), 1, atol=1e-12)
    np.testing.assert_allclose((hands.axis * hands.palm).sum(axis=1), 0, atol=1e-12)
    np.testing.assert_allclose(hands.pad - hands.joints[:, 6], PAD_OFFSET * hands.axis, atol=1e-12)


@given(shares)
def test_no_posture_stretches_an_arm(kinematics, shares):
    joints = kinematics.hands(within_limits(kinematics, shares)).joints
    lengths = np.linalg.norm(np.diff(joints, axis=1), axis=2)
    np.testing.assert_allclose(lengths, np.linalg.norm(np.diff(kinematics.positions, axis=1), axis=2), atol=1e-12)


def test_at_angle_zero_both_arms_are_stretched_sideways_with_the_palms_down(kinematics):
    hands = kinematics.hands(np.zeros((2, 7)))
    for side, mirror in enumerate((np.eye(3), MIRROR)):
        wrist = arm(SIDES[side])[-1].position
        np.testing.assert_allclose(hands.axis[side], mirror @ ARM_AXIS, atol=1e-12)
        np.testing.assert_allclose(hands.pad[side], wrist + PAD_OFFSET * mirror @ ARM_AXIS, atol=1e-12)
        assert hands.palm[side].tolist() == [0, 0, -1]


def test_the_home_posture_is_within_the_limits_and_has_the_hands_beside_the_cube(kinematics):
    assert (kinematics.lower < HOME_POSTURE).all()
    assert (kinematics.upper > HOME_POSTURE).all()
    left, right = kinematics.hands(HOME_POSTURE).pad
    assert left[1] > 0.14
    assert right[1] < -0.14
    assert left[0] == pytest.approx(0.42, abs=0.1)


def test_pybullet_has_the_hands_where_the_kinematics_have_them(robot):
    rng = np.random.default_rng(0)
    for _ in range(40):
        angles = rng.uniform(robot.kinematics.lower, robot.kinematics.upper)
        robot.reset(angles)
        hands = robot.kinematics.hands(angles)
        for side in range(2):
            *_, place, turn = pybullet.getLinkState(
                robot.body, robot.arm_joints[7 * side + 6], computeForwardKinematics=1, physicsClientId=robot.client
            )
            rotation = np.array(pybullet.getMatrixFromQuaternion(turn)).reshape(3, 3)
            np.testing.assert_allclose(place, hands.joints[side, 6], atol=1e-6)
            np.testing.assert_allclose(rotation, hands.rotation[side], atol=1e-6)
            out = PAD_OFFSET * ARM_AXIS * ([1, 1, 1] if side == 0 else [1, -1, 1])
            np.testing.assert_allclose(place + rotation @ out, hands.pad[side], atol=1e-6)


def test_cross_is_the_cross_product_along_the_last_axis():
    a, b = np.random.default_rng(0).normal(size=(2, 4, 5, 3))
    np.testing.assert_allclose(cross(a, b), np.cross(a, b), atol=1e-15)
