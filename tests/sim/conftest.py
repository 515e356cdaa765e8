import pybullet
import pytest

from sim.bodies.prepared_robot import shell
from sim.bodies.robot import RobotBody
from sim.manipulation.impedance_control import TIME_STEP
from sim.worlds import meshes_world, picture_box_world


@pytest.fixture(scope="session", autouse=True)
def quickly_calibrated(request):
    """Let a third of the things calibrate spaces of features, but where slow tests run: it takes ten seconds each."""
    with pytest.MonkeyPatch.context() as patch:
        if "not slow" in request.config.option.markexpr:
            patch.setattr(picture_box_world, "_CALIBRATION_BOXES", 8)
            patch.setattr(meshes_world, "_CALIBRATION_THINGS", 7)
        yield


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
