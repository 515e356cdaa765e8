import pybullet
import pytest

from sim.bodies.robot import RobotBody
from sim.bodies.urdf_reader import read_description
from sim.bodies.urdf_writer import write_robot
from sim.manipulation.impedance_control import TIME_STEP


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
