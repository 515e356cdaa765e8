"""Weighing on torques that a force at the pads accounts for, without any simulation of contact."""

import numpy as np
import pytest

from sim.bodies.kinematics import cross
from sim.manipulation.impedance_control import TIME_STEP
from sim.manipulation.weighing import Scales, TorqueSensors
from sim.worlds.domain_randomization import Circumstances
from sim.worlds.scene import Scene

MASS = 0.9
STEPS = 240


@pytest.fixture(scope="module")
def robot():
    made = Scene(Circumstances(), [])
    yield made.robot
    made.close()


def a_sweep(robot, force):
    """Return angles, speeds and torques of arms that swing from rest to rest; each hand lifts with ``force`` (N)."""
    time = np.arange(STEPS + 1) * TIME_STEP
    phase = 2 * np.pi * time / time[-2]
    swing = 0.02 * np.ones((2, 7))
    angles = robot.model.home + (1 - np.cos(phase))[:, None, None] * swing
    velocities = np.diff(angles, axis=0) / TIME_STEP
    accelerations = np.vstack([np.diff(velocities, axis=0) / TIME_STEP, np.zeros((1, 2, 7))])
    torques = []
    for posture, velocity, acceleration in zip(angles, velocities, accelerations, strict=False):
        hands = robot.kinematics.hands(posture)
        normal = hands.pad[::-1] - hands.pad
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        reach = robot.kinematics.pad_radius[:, None] * normal
        at_contact = hands.jacobian[:, :3] + cross(hands.jacobian[:, 3:].swapaxes(1, 2), reach[:, None]).swapaxes(1, 2)
        # The grip, the weight, and a moment about the normal.
        pull = np.array([0.0, 0.0, force]) + 60.0 * normal
        moment = 0.3 * (normal[:, None] @ hands.jacobian[:, 3:])[:, 0]
        held = (at_contact.swapaxes(1, 2) @ pull[:, :, None])[..., 0] + moment
        torques.append(robot.torques_of(posture, velocity, acceleration) + 0.1 * velocity + held)
    return angles[:-1], velocities, np.array(torques)


@pytest.fixture(scope="module")
def motions(robot):
    """A motion with empty hands, and one in which they hold something."""
    empty = robot.torques_of(robot.model.home, np.zeros((2, 7)), np.zeros((2, 7)))
    still = np.tile(robot.model.home, (STEPS, 1, 1))
    return (still, np.zeros_like(still), np.tile(empty, (STEPS, 1, 1))), a_sweep(robot, MASS * 9.81 / 2)


def weighed(robot, motions, sensors, tared=True):
    free, held = motions
    scales, rng = Scales(robot, sensors), np.random.default_rng(0)
    if tared:
        scales.tare(*free, rng)
    scales.feel(*held, rng)
    return scales.mass()


def test_perfect_sensors_tell_the_mass(robot, motions):
    assert weighed(robot, motions, TorqueSensors(np.zeros((2, 7)), np.ones((2, 7)), 0.0)) == pytest.approx(MASS)


def test_what_sensors_are_off_by_is_tared_away(robot, motions):
    sensors = TorqueSensors(np.random.default_rng(1).normal(0, 1.0, (2, 7)), np.ones((2, 7)), 0.0)
    assert weighed(robot, motions, sensors) == pytest.approx(MASS)
    assert abs(weighed(robot, motions, sensors, tared=False) - MASS) > 0.05


def test_noise_averages_out(robot, motions):
    assert weighed(robot, motions, TorqueSensors(np.zeros((2, 7)), np.ones((2, 7)), 0.5)) == pytest.approx(
        MASS, abs=0.2
    )


def test_sensors_that_were_drawn_weigh_about_right(robot, motions):
    found = [weighed(robot, motions, TorqueSensors.drawn(np.random.default_rng(seed))) for seed in range(8)]
    assert np.abs(np.array(found) - MASS).max() < 0.35


def test_nothing_held_is_no_mass(robot, motions):
    scales = Scales(robot, TorqueSensors(np.zeros((2, 7)), np.ones((2, 7)), 0.0))
    assert scales.mass() is None
    scales.feel(*a_sweep(robot, -1.0), np.random.default_rng(0))
    assert scales.mass() is None
    scales.clear()
    scales.feel(*motions[1], np.random.default_rng(0))
    assert scales.mass() == pytest.approx(MASS)
