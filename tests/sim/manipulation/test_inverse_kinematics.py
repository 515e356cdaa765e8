import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from sim.bodies.prepared_robot import HOME_POSTURE
from sim.manipulation.inverse_kinematics import HandTask, Solution, solve
from tests.sim.postures import angle_between, shares, within_limits

#: Across the front of the robot: what the left hand presses, and the right.
ACROSS = np.array([[0.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
DOWN = np.array([[0.0, 0.0, -1.0]] * 2)
UNIT_VECTORS = arrays(np.float64, (2, 3), elements=st.floats(-1, 1)).filter(
    lambda vectors: (np.linalg.norm(vectors, axis=1) > 0.1).all()
)


def reachable_task(kinematics, rng, cone=0.3, spread=0.5):
    angles = HOME_POSTURE + rng.uniform(-spread, spread, HOME_POSTURE.shape)
    hands = kinematics.hands(np.clip(angles, kinematics.lower + 0.05, kinematics.upper - 0.05))
    return HandTask(hands.pad, hands.axis, cone, hands.palm)


def home_task(kinematics, *, ahead=0.0, up=0.0, cone=0.6, palm=DOWN):
    """The hands as they are at home, moved a little."""
    return HandTask(kinematics.hands(HOME_POSTURE).pad + np.array([ahead, 0, up]), ACROSS, cone, palm)


def test_what_an_arm_can_reach_is_reached(kinematics):
    rng = np.random.default_rng(0)
    tasks = [reachable_task(kinematics, rng) for _ in range(250)]
    assert all(solve(kinematics, task, HOME_POSTURE, HOME_POSTURE).reaches() for task in tasks)


def test_both_hands_on_a_cube_that_is_lifted_and_moved_are_reached(kinematics):
    for ahead in (-0.04, 0.0, 0.04):
        for up in (-0.04, 0.0, 0.04, 0.08):
            task = home_task(kinematics, ahead=ahead, up=up)
            assert solve(kinematics, task, HOME_POSTURE, HOME_POSTURE).reaches()


@given(pad=arrays(np.float64, (2, 3), elements=st.floats(-1.5, 1.5)), vectors=UNIT_VECTORS, shares=shares)
def test_joint_limits_are_kept_and_misses_told_wherever_the_hands_are_sent(kinematics, pad, vectors, shares):
    normal = vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    solution = solve(kinematics, HandTask(pad, normal, 0.4), within_limits(kinematics, shares), HOME_POSTURE)
    assert (solution.angles >= kinematics.lower).all()
    assert (solution.angles <= kinematics.upper).all()
    hands = kinematics.hands(solution.angles)
    np.testing.assert_allclose(solution.position_error, np.linalg.norm(pad - hands.pad, axis=1), atol=1e-12)
    outside = np.maximum(0, angle_between(hands.axis, normal) - 0.4)
    np.testing.assert_allclose(solution.cone_error, outside, atol=1e-12)
    assert not solution.palm_error.any()


def test_a_place_out_of_reach_is_missed_by_what_is_too_far_for_a_stretched_arm(kinematics):
    shoulders = kinematics.positions[:, 0]
    reach = np.linalg.norm(kinematics.hands(np.zeros((2, 7))).pad - shoulders, axis=1)
    task = HandTask(shoulders + np.array([3.0, 0.0, 0.0]), ACROSS, np.pi)
    solution = solve(kinematics, task, HOME_POSTURE, HOME_POSTURE)
    assert not solution.reaches()
    # Offset joints: the longest way to the pad may be a little more than that of a straight arm.
    assert (solution.position_error >= 3.0 - reach - 0.01).all()
    assert (solution.position_error <= 3.0).all()


@pytest.mark.parametrize("cone", [0.1, 0.3, 0.6])
@pytest.mark.parametrize("towards", [[1, 0, 0], [0, 0, 1], [0, 0, -1]])
@pytest.mark.parametrize("beyond", [1.2, 1.5, 2.0])
def test_hands_lean_no_further_than_the_cone(kinematics, cone, towards, beyond):
    hands = kinematics.hands(HOME_POSTURE)
    across = np.array(towards) - hands.axis * (hands.axis @ towards)[:, None]
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    normal = np.cos(cone * beyond) * hands.axis + np.sin(cone * beyond) * across
    solution = solve(kinematics, HandTask(hands.pad, normal, cone), HOME_POSTURE, HOME_POSTURE)
    assert solution.reaches()
    assert solution.cone_error.tolist() == [0, 0]
    assert (angle_between(kinematics.hands(solution.angles).axis, normal) <= cone).all()


def test_a_hand_within_the_cone_is_not_turned_further(kinematics):
    hands = kinematics.hands(HOME_POSTURE)
    for cone, stays in ((0.5, True), (0.05, False)):
        tilted = hands.axis + 0.2 * hands.palm
        task = HandTask(hands.pad, tilted / np.linalg.norm(tilted, axis=1, keepdims=True), cone)
        angles = solve(kinematics, task, HOME_POSTURE, HOME_POSTURE).angles
        assert np.array_equal(angles, HOME_POSTURE) == stays


def test_palms_turn_to_where_they_shall_point(kinematics):
    for angle in np.radians([-20, -10, 10, 20, 30]):
        palm = np.array([[np.sin(angle), 0.0, -np.cos(angle)]] * 2)
        solution = solve(kinematics, home_task(kinematics, palm=palm), HOME_POSTURE, HOME_POSTURE)
        assert solution.reaches()
        now = kinematics.hands(solution.angles).palm * [1, 0, 1]  # about the normals, which are along y
        np.testing.assert_allclose(angle_between(now, palm), solution.palm_error, atol=1e-12)
        assert (solution.palm_error < 0.01).all()


def test_a_palm_that_cannot_be_turned_far_enough_is_told_as_an_error(kinematics):
    near = (HOME_POSTURE - 0.3, HOME_POSTURE + 0.3)
    stiff = kinematics.limited(*near)
    task = home_task(kinematics, palm=-DOWN)
    assert solve(kinematics, task, HOME_POSTURE, HOME_POSTURE).reaches()
    solution = solve(stiff, task, HOME_POSTURE, HOME_POSTURE)
    flat = kinematics.hands(solution.angles).palm * [1, 0, 1]
    np.testing.assert_allclose(solution.palm_error, angle_between(flat, task.palm), atol=1e-12)
    assert (solution.palm_error > np.pi / 2).all()
    assert not solution.reaches()


def test_a_task_that_leaves_the_palms_free_has_no_palm_error(kinematics):
    solution = solve(kinematics, home_task(kinematics, ahead=0.05, palm=None), HOME_POSTURE, HOME_POSTURE)
    assert solution.reaches()
    assert solution.palm_error.tolist() == [0, 0]


def test_of_the_postures_that_do_a_task_the_one_nearer_to_rest_is_taken(kinematics):
    task = home_task(kinematics, palm=None)
    rests = [HOME_POSTURE + np.array([0, 0, tilt, 0, 0, 0, 0]) for tilt in (-0.5, 0.5)]
    start = solve(kinematics, home_task(kinematics, ahead=0.05), HOME_POSTURE, HOME_POSTURE).angles
    ends = [solve(kinematics, task, start, rest).angles for rest in rests]
    assert (ends[0][:, 2] < ends[1][:, 2]).all()


def test_the_same_question_has_the_same_answer_bit_for_bit(kinematics):
    task = reachable_task(kinematics, np.random.default_rng(2))
    first, second = (solve(kinematics, task, HOME_POSTURE, HOME_POSTURE) for _ in range(2))
    assert np.array_equal(first.angles, second.angles)
    assert np.array_equal(first.position_error, second.position_error)


def test_the_arms_are_solved_for_each_alone(kinematics):
    rng = np.random.default_rng(3)
    one, other = reachable_task(kinematics, rng), reachable_task(kinematics, rng)
    swapped = HandTask(*(np.stack([a[0], b[1]]) for a, b in ((one.pad, other.pad), (one.normal, other.normal))), 0.3)
    alone = HandTask(one.pad, one.normal, 0.3)
    left = [solve(kinematics, task, HOME_POSTURE, HOME_POSTURE).angles[0] for task in (alone, swapped)]
    # They stop together: the arm that is there first may go a little further towards rest.
    hands = [kinematics.hands(np.stack([angles, HOME_POSTURE[1]])).pad[0] for angles in left]
    assert np.linalg.norm(hands[0] - hands[1]) < 0.002


def test_a_start_outside_the_limits_is_brought_inside(kinematics):
    task = home_task(kinematics)
    outside = np.where(np.arange(7) % 2, kinematics.upper + 2.0, kinematics.lower - 2.0)
    clipped = np.clip(outside, kinematics.lower, kinematics.upper)
    solutions = [solve(kinematics, task, start, HOME_POSTURE) for start in (outside, clipped)]
    assert np.array_equal(solutions[0].angles, solutions[1].angles)


def test_the_start_is_not_changed(kinematics):
    start = HOME_POSTURE.copy()
    solve(kinematics, home_task(kinematics, ahead=0.05), start, HOME_POSTURE)
    assert np.array_equal(start, HOME_POSTURE)


@pytest.mark.parametrize(
    ("position", "cone", "palm", "reaches"),
    [
        ([0.005, 0.005], [0.0, 0.0], [0.0, 0.0], True),
        ([0.005, 0.007], [0.0, 0.0], [0.0, 0.0], False),
        ([0.0, 0.0], [0.09, 0.09], [0.09, 0.0], True),
        ([0.0, 0.0], [0.11, 0.0], [0.0, 0.0], False),
        ([0.0, 0.0], [0.0, 0.0], [0.0, 0.11], False),
    ],
)
def test_a_task_is_reached_within_six_millimetres_and_a_tenth_of_a_radian(kinematics, position, cone, palm, reaches):
    errors = (np.array(error) for error in (position, cone, palm))
    assert Solution(HOME_POSTURE, *errors, kinematics.hands(HOME_POSTURE)).reaches() is reaches
