from xml.etree import ElementTree

import numpy as np
import pybullet
import pytest

from sim.bodies.prepared_robot import HOME_POSTURE, TUCKED_POSTURE, like_the_shell
from sim.bodies.rail import RAIL_FORCE, RAIL_SPEED
from sim.bodies.robot import RobotBody
from sim.manipulation.impedance_control import TIME_STEP
from tests.sim import descriptions
from tests.sim.descriptions import written

REACH = 0.9


@pytest.fixture
def robot(client):
    made = RobotBody(client, rail_reach=REACH)
    made.reset(TUCKED_POSTURE)
    return made


def ride(robot, end):
    """Slide, the arms held by their own weight's torques; return the measured places, speeds and forces."""
    measured = []
    for _ in robot.rail.ride(end):
        robot.apply(robot.gravity_torques(robot.state()[0]))
        pybullet.stepSimulation(physicsClientId=robot.client)
        measured.append((robot.rail.position, robot.rail.speed, robot.rail.force))
    return np.array(measured).T


@pytest.mark.parametrize("end", [0.85, -0.4])
def test_a_ride_ends_where_it_should_within_the_motors_limits(robot, end):
    places, speeds, forces = ride(robot, end)
    assert places[-1] == pytest.approx(end, abs=0.001)
    assert (np.diff(places) * np.sign(end) > -1e-4).all()
    assert np.abs(speeds).max() <= RAIL_SPEED
    assert np.abs(forces).max() <= 0.5 * RAIL_FORCE
    assert np.diff(places).max() / TIME_STEP <= RAIL_SPEED
    assert places.max() <= REACH
    assert robot.place[1] == places[-1]


def test_a_ride_to_where_the_robot_is_goes_nowhere(robot):
    places, _, _ = ride(robot, 0.0)
    assert np.abs(places).max() < 1e-6


def test_the_motor_pushes_no_harder_than_it_can(robot):
    """A jump of the target: without its limits the motor would be there in a tenth of a second."""
    robot.rail.drive(0.8)
    speeds, forces = [], []
    for _ in range(60):
        pybullet.stepSimulation(physicsClientId=robot.client)
        speeds.append(abs(robot.rail.speed))
        forces.append(abs(robot.rail.force))
    assert max(speeds) <= RAIL_SPEED * 1.001
    assert max(forces) <= RAIL_FORCE * 1.001


def test_the_robots_own_frame_slides_with_it(robot, client):
    eye, direction = robot.eye()
    angles, _ = robot.state()
    torques = robot.gravity_torques(angles)
    robot.rail.reset(0.7)
    np.testing.assert_allclose(robot.place, [0.0, 0.7, 0.0])
    np.testing.assert_allclose(robot.eye(), (eye, direction), atol=1e-6)
    np.testing.assert_allclose(robot.gravity_torques(angles), torques, atol=1e-6)


def test_a_users_description_is_put_on_a_rail_as_it_lies(client, tmp_path):
    tree = descriptions.mounted(descriptions.slashed(descriptions.parsed()))
    shell, own = RobotBody(client, rail_reach=REACH), RobotBody(client, like_the_shell(written(tree, tmp_path)), REACH)
    for robot in (shell, own):
        robot.rail.reset(-0.6)
    np.testing.assert_allclose(own.eye(), shell.eye(), atol=1e-6)
    np.testing.assert_allclose(own.place, shell.place)
    np.testing.assert_allclose(own.gravity_torques(HOME_POSTURE), shell.gravity_torques(HOME_POSTURE), atol=1e-4)
    pads = [
        pybullet.getLinkState(robot.body, robot.hands[0], computeForwardKinematics=1, physicsClientId=client)[4]
        for robot in (shell, own)
    ]
    np.testing.assert_allclose(*pads, atol=1e-6)


def test_meshes_are_found_where_pybullet_would_find_them(client, tmp_path):
    (tmp_path / "meshes").mkdir()
    (tmp_path / "urdf").mkdir()
    tree = descriptions.parsed()
    for number, mesh in enumerate(tree.iter("mesh")):
        mesh.set("filename", f"{('package://', '')[number % 2]}meshes/{mesh.get('filename')}")
    written(tree, tmp_path / "meshes")
    path = tmp_path / "urdf" / "own.urdf"
    path.write_bytes(ElementTree.tostring(tree))
    own, shell = RobotBody(client, like_the_shell(path), REACH), RobotBody(client)
    assert len(pybullet.getVisualShapeData(own.body, physicsClientId=client)) == len(
        pybullet.getVisualShapeData(shell.body, physicsClientId=client)
    )
