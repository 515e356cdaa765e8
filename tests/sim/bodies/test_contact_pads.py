from xml.etree import ElementTree

import numpy as np
import pybullet
import pytest

from sim.bodies.contact_pads import contact_pad
from sim.bodies.prepared_robot import HOME_POSTURE, like_the_shell, shell
from sim.bodies.robot import RobotBody
from tests.sim import descriptions
from tests.sim.descriptions import written

AHEAD = np.array([0.0, 1.0, 0.0])


def stood(client, kind, position=(0.0, 0.0, 0.0), **sizes):
    shape = pybullet.createCollisionShape(kind, physicsClientId=client, **sizes)
    return pybullet.createMultiBody(0, shape, basePosition=position, physicsClientId=client)


def test_the_pad_of_a_ball_is_the_ball(client):
    ball = stood(client, pybullet.GEOM_SPHERE, (0.01, 0.07, -0.02), radius=0.045)
    middle, radius = contact_pad(client, ball, -1, np.zeros(3), AHEAD)
    np.testing.assert_allclose(middle, [0.01, 0.07, -0.02], atol=0.002)
    assert radius == pytest.approx(0.045, abs=0.002)


def test_the_pad_of_a_box_reaches_as_far_as_the_box_on_the_whole(client):
    """The support function of a box of half extents a is |n|·a; the fitted ball's is that on the mean of all leans."""
    half = np.array([0.04, 0.06, 0.03])
    box = stood(client, pybullet.GEOM_BOX, halfExtents=half.tolist())
    middle, radius = contact_pad(client, box, -1, np.zeros(3), AHEAD)
    np.testing.assert_allclose(middle[[0, 2]], 0, atol=0.003)
    reaches = []
    for lean in (0.3, 0.6, 0.9, 1.2):
        for turn in np.linspace(0, 2 * np.pi, 12, endpoint=False):
            normal = np.array([np.sin(lean) * np.cos(turn), np.cos(lean), np.sin(lean) * np.sin(turn)])
            reaches.append(normal @ middle + radius - np.abs(normal) @ half)
    assert abs(np.mean(reaches)) < 0.003
    assert np.abs(reaches).max() < 0.02


def test_only_the_hand_is_felt(client):
    ball = stood(client, pybullet.GEOM_SPHERE, radius=0.05)
    stood(client, pybullet.GEOM_SPHERE, (0.3, 0.0, 0.0), radius=0.05)
    alone = contact_pad(client, ball, -1, np.zeros(3), AHEAD)
    np.testing.assert_allclose(alone[0], 0, atol=0.002)


def test_the_shells_own_pads_are_found(client):
    """Where the kinematics has them, with the arms at home: nothing is told of the pads but the shapes of the hands."""
    robot = RobotBody(client)
    hands = robot.kinematics.hands(HOME_POSTURE)
    for side, hand in enumerate(robot.hands):
        middle, radius = contact_pad(client, robot.body, hand, hands.joints[side, -1], hands.axis[side])
        np.testing.assert_allclose(middle, hands.pad[side], atol=0.002)
        assert radius == pytest.approx(shell().kinematics.pad_radius[side], abs=0.002)


def test_a_fist_has_a_pad_before_its_knuckles(client, tmp_path):
    robot = RobotBody(
        client, like_the_shell(written(descriptions.with_fists_of_boxes(descriptions.parsed()), tmp_path))
    )
    hands = robot.kinematics.hands(HOME_POSTURE)
    pads = []
    for side, hand in enumerate(robot.hands):
        wrist = hands.joints[side, -1]
        middle, radius = contact_pad(client, robot.body, hand, wrist, hands.axis[side])
        # The knuckles' front is 12.4 cm from the wrist.
        assert (middle - wrist) @ hands.axis[side] + radius == pytest.approx(0.124, abs=0.012)
        pads.append(middle * [1, 1 - 2 * side, 1])
    np.testing.assert_allclose(*pads, atol=0.003)


def test_a_hand_that_cannot_be_touched_is_refused(client, tmp_path):
    tree = descriptions.parsed()
    for link in tree.iter("link"):
        for collision in list(link.iterfind("collision")):
            link.remove(collision)
    assert isinstance(tree, ElementTree.Element)
    robot = RobotBody(client, like_the_shell(written(tree, tmp_path)))
    with pytest.raises(ValueError, match="a hand without a shape to touch with"):
        contact_pad(client, robot.body, robot.hands[0], np.zeros(3), AHEAD)
