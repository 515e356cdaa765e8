import pybullet
import pytest

from sim.robot.body import RobotBody
from sim.robot.controller import TIME_STEP
from sim.robot.description import read_description
from sim.robot.urdf import write_robot


@pytest.fixture
def client():
    """A PyBullet client with nothing in it but gravity."""
    made = pybullet.connect(pybullet.DIRECT)
    pybullet.setTimeStep(TIME_STEP, physicsClientId=made)
    pybullet.setGravity(0, 0, -9.81, physicsClientId=made)
    yield made
    pybullet.disconnect(physicsClientId=made)


@pytest.fixture
def robot(client):
    return RobotBody(client)


@pytest.fixture(scope="session")
def kinematics(tmp_path_factory):
    return read_description(write_robot(tmp_path_factory.mktemp("robot"))).kinematics()
