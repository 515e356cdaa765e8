import pybullet
import pytest

from sim.bodies.prepared_robot import shell
from sim.bodies.robot import RobotBody
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
def kinematics():
    return shell().kinematics
