import numpy as np
import pybullet
import pytest

from sim.bodies.prepared_robot import HOME_POSTURE
from sim.manipulation.impedance_control import TIME_STEP, ArmController, JointTarget


@pytest.fixture
def controller(robot):
    return ArmController(robot, lambda: pybullet.stepSimulation(physicsClientId=robot.client))


def target(controller, change, seconds=0.8, still=0.0):
    angles = HOME_POSTURE + np.asarray(change, dtype=float)
    return JointTarget(angles, controller.robot.gravity_torques(angles), seconds, still)


def near(robot, rng, most):
    """A change of posture that keeps the joints' limits."""
    margin = 0.02
    change = rng.uniform(-most, most, HOME_POSTURE.shape)
    kinematics = robot.kinematics
    return np.clip(HOME_POSTURE + change, kinematics.lower + margin, kinematics.upper - margin) - HOME_POSTURE


def all_alike(joint, change):
    """The same change of one joint in both arms."""
    changes = np.zeros((2, 7))
    changes[:, joint] = change
    return changes


def recorded(controller):
    """All postures and torques from now on, a row a step."""
    states, torques = [], []
    drive = controller.robot.drive

    def spy(wanted):
        states.append(controller.robot.state())
        torques.append(np.reshape(wanted, (2, 7)))
        drive(wanted)

    controller.robot.drive = spy
    return states, torques


def test_arms_that_are_held_stay_where_they_are(controller):
    controller.hold(1.0)
    angles, speeds = controller.robot.state()
    assert np.abs(angles - HOME_POSTURE).max() < 0.01
    assert np.abs(speeds).max() < 0.01


def test_arms_sag_if_gravity_is_not_fed_forward(controller):
    controller.feedforward = np.zeros((2, 7))
    controller.hold(1.0)
    angles, _ = controller.robot.state()
    sag = np.abs(angles - HOME_POSTURE).max(axis=1)
    assert (sag > 0.02).all()
    assert (sag < 0.2).all()


def test_gravity_is_fed_forward_from_the_beginning(controller):
    np.testing.assert_array_equal(controller.feedforward, controller.robot.gravity_torques(HOME_POSTURE))
    np.testing.assert_array_equal(controller.reference, controller.robot.state()[0])


@pytest.mark.parametrize("seed", range(4))
def test_a_motion_ends_at_rest_at_its_target(controller, seed):
    change = near(controller.robot, np.random.default_rng(seed), 0.6)
    controller.run([target(controller, change, still=0.5)])
    angles, speeds = controller.robot.state()
    assert np.abs(angles - HOME_POSTURE - change).max() < 0.01
    assert np.abs(speeds).max() < 0.05
    np.testing.assert_array_equal(controller.reference, HOME_POSTURE + change)


def test_a_motion_through_several_targets_ends_at_the_last_of_them(controller):
    rng = np.random.default_rng(0)
    changes = [near(controller.robot, rng, 0.3) for _ in range(4)]
    controller.run([*(target(controller, change, 0.3) for change in changes[:3]), target(controller, changes[3], 0.5)])
    controller.hold(0.5)
    angles, speeds = controller.robot.state()
    assert np.abs(angles - HOME_POSTURE - changes[3]).max() < 0.01
    assert np.abs(speeds).max() < 0.05


def test_a_target_on_the_way_is_passed_near_and_not_stopped_at(controller):
    states, _ = recorded(controller)
    controller.run([target(controller, all_alike(0, turn), 0.5) for turn in (-0.3, -0.6)])
    angles, speeds = (np.array(values) for values in zip(*states, strict=True))
    on_the_way = round(0.5 / TIME_STEP)
    assert np.abs(angles[on_the_way, :, 0] - HOME_POSTURE[:, 0] + 0.3).max() < 0.05
    assert (speeds[on_the_way, :, 0] < -0.4).all()


def test_a_target_that_asks_to_wait_is_stopped_at(controller):
    states, _ = recorded(controller)
    targets = [target(controller, all_alike(0, -0.3), 0.5, still=0.5), target(controller, all_alike(0, -0.6), 0.5)]
    controller.run(targets)
    waited = round(1.0 / TIME_STEP) - 1
    angles, speeds = states[waited]
    assert np.abs(angles - targets[0].angles).max() < 0.01
    assert np.abs(speeds).max() < 0.05


def test_a_motion_takes_the_time_it_is_given_and_then_waits(controller):
    controller.run([target(controller, all_alike(0, -0.1), 0.5, still=0.25)])
    assert controller.exertion.steps == round(0.75 / TIME_STEP)


def test_a_target_too_far_for_its_time_takes_longer_instead_of_exceeding_the_speed(controller):
    robot = controller.robot
    changes = all_alike(0, -1.0) + all_alike(3, 0.7)
    controller.run([target(controller, changes, 0.05)])
    seconds = controller.exertion.steps * TIME_STEP
    # A smooth motion from rest to rest has 1.5 times its mean speed in the middle.
    assert seconds > 1.5 * 1.0 / robot.velocity[0, 0]
    assert seconds < 3.0 * 1.0 / robot.velocity[0, 0]
    assert (controller.exertion.velocity <= 1).all()
    controller.hold(0.5)
    assert np.abs(robot.state()[0] - HOME_POSTURE - changes).max() < 0.01


def steps_for(controller, changes):
    before = controller.exertion.steps
    controller.run([target(controller, changes, 0.0)])
    taken = controller.exertion.steps - before
    controller.run([target(controller, np.zeros((2, 7)), 0.0)])
    return taken


def test_the_slowest_joint_sets_the_time_for_all(controller):
    # Joint 4 may turn at 3.5 rad/s, joint 0 at 2.5.
    slow, fast = (steps_for(controller, all_alike(joint, -1.0)) for joint in (0, 4))
    assert slow / fast == pytest.approx(3.5 / 2.5, rel=0.01)
    assert steps_for(controller, all_alike(0, -1.0) + all_alike(4, -1.0)) == slow


@pytest.mark.parametrize("seed", range(4))
def test_speeds_and_torques_stay_within_the_limits(controller, seed):
    robot, rng = controller.robot, np.random.default_rng(seed)
    states, torques = recorded(controller)
    controller.run([target(controller, near(robot, rng, 0.5), 0.6, still=0.1) for _ in range(4)])
    speeds, torques = np.array([speed for _, speed in states]), np.array(torques)
    assert (np.abs(speeds) <= robot.velocity).all()
    assert (np.abs(torques) <= robot.effort).all()
    exertion = controller.exertion
    np.testing.assert_allclose(exertion.velocity, (np.abs(speeds) / robot.velocity).max(axis=0))
    np.testing.assert_allclose(exertion.effort, (np.abs(torques) / robot.effort).max(axis=0))
    assert (exertion.velocity <= 1).all()
    assert (exertion.effort <= 1).all()
    assert exertion.velocity.max() > 0.3
    assert exertion.steps == len(states)
    assert exertion.saturated_steps <= exertion.steps


def test_torques_are_cut_at_the_limits(controller):
    robot = controller.robot
    _, torques = recorded(controller)
    controller.feedforward = np.full((2, 7), 1e4)
    controller.hold(5 * TIME_STEP)
    assert np.array_equal(torques, np.broadcast_to(robot.effort, (5, 2, 7)))
    assert controller.exertion.saturated_steps == controller.exertion.steps == 5
    assert controller.exertion.effort.tolist() == np.ones((2, 7)).tolist()


def test_no_torque_is_cut_in_an_easy_motion(controller):
    controller.run([target(controller, all_alike(3, -0.2), 1.0)])
    assert controller.exertion.saturated_steps == 0
    assert controller.exertion.effort.max() < 0.8


def test_a_new_controller_takes_the_arms_where_they_are(controller):
    change = all_alike(0, -0.3)
    controller.robot.reset(HOME_POSTURE + change)
    another = ArmController(controller.robot, lambda: pybullet.stepSimulation(physicsClientId=controller.robot.client))
    assert another.exertion.steps == 0
    assert not another.exertion.velocity.any()
    another.hold(0.2)
    assert np.abs(another.robot.state()[0] - HOME_POSTURE - change).max() < 0.01


def test_a_push_is_given_way_to_and_comes_back(controller):
    robot = controller.robot
    controller.hold(0.1)
    rest = controller.feedforward
    controller.feedforward = rest + all_alike(0, 20.0)
    controller.hold(1.0)
    pushed = robot.state()[0][:, 0] - HOME_POSTURE[:, 0]
    assert (pushed > 0.01).all()
    controller.feedforward = rest
    controller.hold(1.0)
    assert np.abs(robot.state()[0] - HOME_POSTURE).max() < 0.002
