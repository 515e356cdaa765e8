from itertools import groupby, pairwise

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.worlds.arcube import ACTION_SOURCES, SUCCESSORS, rotation_of
from sim.bodies.cube import CUBE_CENTRE, nearest_orientation
from sim.bodies.prepared_robot import HOME_POSTURE
from sim.manipulation import waypoints as plans
from sim.manipulation.inverse_kinematics import solve
from sim.manipulation.waypoints import INWARD, Waypoint, about_vertical, towards_robot
from sim.vision.cube_pose import CubePose

STILL = np.zeros((2, 3))
PADS = np.full(2, 0.05)
QUARTERS = {"flip": towards_robot(np.pi / 2), "left": about_vertical(np.pi / 2), "right": about_vertical(-np.pi / 2)}
LEFT, RIGHT = 1, -1


def standing(ahead=0.0, left=0.0, degrees=0.0):
    return CubePose(CUBE_CENTRE + np.array([ahead, left, 0]), np.radians(degrees))


def halfway(direction, ahead=0.0, left=0.0, degrees=0.0):
    """Where a cube stands after the first half of a turn, off by a little."""
    *_, last = plans.turn_to_halfway(standing(), direction)
    return CubePose(last.position + np.array([ahead, left, 0]), direction * np.pi / 4 + np.radians(degrees))


PLANS = {
    "flip": lambda: plans.flip(standing(0.01, -0.01, 4)),
    "first half to the left": lambda: plans.turn_to_halfway(standing(0.01, -0.01, 4), LEFT),
    "first half to the right": lambda: plans.turn_to_halfway(standing(0.01, -0.01, 4), RIGHT),
    "second half to the left": lambda: plans.turn_from_halfway(halfway(LEFT, 0.01, degrees=-3), LEFT),
    "second half to the right": lambda: plans.turn_from_halfway(halfway(RIGHT, 0.01, degrees=-3), RIGHT),
    "square": lambda: plans.square(standing(0.01, -0.01, 4)),
}
every_plan = pytest.mark.parametrize("plan", PLANS.values(), ids=PLANS)


def phases(waypoints):
    return [name for name, _ in groupby(waypoint.name for waypoint in waypoints)]


def turned_while_held(waypoints):
    held = [waypoint.rotation for waypoint in waypoints if waypoint.grip]
    return held[-1] @ held[0].T


def angle_of(rotation):
    return float(np.linalg.norm(cv2.Rodrigues(rotation)[0]))


@pytest.mark.parametrize("action", ACTION_SOURCES)
def test_each_action_turns_every_orientation_into_its_successor(action):
    for orientation in range(24):
        after = rotation_of(SUCCESSORS[orientation][list(ACTION_SOURCES).index(action)])
        np.testing.assert_allclose(QUARTERS[action] @ rotation_of(orientation), after, atol=1e-12)


@given(st.floats(-np.pi, np.pi))
def test_a_turn_has_the_angle_that_is_asked_for(angle):
    for turn in (about_vertical, towards_robot):
        np.testing.assert_allclose(turn(angle) @ turn(angle).T, np.eye(3), atol=1e-12)
        np.testing.assert_allclose(turn(angle) @ turn(-angle), np.eye(3), atol=1e-12)
        assert np.trace(turn(angle)) == pytest.approx(1 + 2 * np.cos(angle))


def test_a_flip_brings_the_top_to_the_front():
    turned = turned_while_held(plans.flip(standing()))
    np.testing.assert_allclose(turned @ [0, 0, 1], [-1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(turned, QUARTERS["flip"], atol=1e-12)


def test_a_flip_ends_square_however_the_cube_stood():
    held = [waypoint for waypoint in plans.flip(standing(0.02, -0.01, 5)) if waypoint.grip]
    np.testing.assert_allclose(held[0].rotation, about_vertical(np.radians(5)), atol=1e-12)
    np.testing.assert_allclose(held[-1].rotation, QUARTERS["flip"], atol=1e-12)
    np.testing.assert_allclose(held[-1].position[:2], CUBE_CENTRE[:2])


@pytest.mark.parametrize(("direction", "action"), [(LEFT, "left"), (RIGHT, "right")])
def test_the_two_halves_of_a_turn_are_a_quarter_turn(direction, action):
    first = turned_while_held(plans.turn_to_halfway(standing(), direction))
    second = turned_while_held(plans.turn_from_halfway(halfway(direction), direction))
    np.testing.assert_allclose(first, about_vertical(direction * np.pi / 4), atol=1e-12)
    np.testing.assert_allclose(second @ first, QUARTERS[action], atol=1e-12)


@pytest.mark.parametrize(
    ("direction", "seen", "grasped"),
    [
        (LEFT, 45, -45),
        (LEFT, 44, -46),
        (LEFT, 40, -50),
        (LEFT, -44, -44),
        (LEFT, -40, -40),
        (RIGHT, -45, 45),
        (RIGHT, -44, 46),
        (RIGHT, -40, 50),
        (RIGHT, 44, 44),
        (RIGHT, 40, 40),
    ],
)
def test_the_second_half_of_a_turn_takes_the_faces_on_the_far_side(direction, seen, grasped):
    # A cube at 44° and one at −46° look alike: either may be what is seen, whichever way the cube was turned.
    waypoints = list(plans.turn_from_halfway(CubePose(CUBE_CENTRE, np.radians(seen)), direction))
    grasps = [waypoint.rotation for waypoint in waypoints if waypoint.name in ("approach", "grasp")]
    np.testing.assert_allclose(grasps, [about_vertical(np.radians(grasped))] * len(grasps), atol=1e-12)
    np.testing.assert_allclose(waypoints[-1].rotation, np.eye(3), atol=1e-12)


def test_a_flip_is_approach_grasp_lift_turn_put_down_release_and_unwind():
    assert phases(plans.flip(standing())) == ["approach", "grasp", "lift", "turn", "put down", "release", "unwind"]


@pytest.mark.parametrize("direction", [LEFT, RIGHT])
def test_a_turn_changes_hands_halfway(direction):
    half = ["approach", "grasp", "lift", "turn", "put down", "release"]
    assert phases(plans.turn_to_halfway(standing(), direction)) == half
    assert phases(plans.turn_from_halfway(halfway(direction), direction)) == ["change hands", *half]


def test_to_square_a_cube_it_is_slid_and_not_turned_in_the_air():
    waypoints = list(plans.square(standing(0.02, 0.01, 5)))
    assert phases(waypoints) == ["approach", "grasp", "slide", "put down", "release"]
    assert max(waypoint.position[2] for waypoint in waypoints) < CUBE_CENTRE[2] + 0.01
    assert angle_of(turned_while_held(waypoints)) == pytest.approx(np.radians(5))
    np.testing.assert_allclose(waypoints[-1].position, CUBE_CENTRE)
    np.testing.assert_allclose(waypoints[-1].rotation, np.eye(3))


def test_only_a_flip_lifts_the_cube_high_enough_to_turn_its_edges_over_the_table():
    # Half the diagonal of a face less half an edge.
    needed = 0.14 * (np.sqrt(2) - 1)
    highest = {name: max(waypoint.position[2] for waypoint in plan()) - CUBE_CENTRE[2] for name, plan in PLANS.items()}
    assert [name for name, height in highest.items() if height > needed] == ["flip"]


@every_plan
def test_hands_grip_only_while_they_press(plan):
    waypoints = list(plan())
    assert all(waypoint.clearance < 0 for waypoint in waypoints if waypoint.grip)
    assert {waypoint.name for waypoint in waypoints if waypoint.grip} <= {"grasp", "lift", "turn", "slide", "put down"}
    assert all(waypoint.grip for waypoint in waypoints if waypoint.name in ("lift", "turn", "slide", "put down"))


@every_plan
def test_hands_touch_before_they_press_and_come_free_at_the_end(plan):
    waypoints = list(plan())
    first = next(number for number, waypoint in enumerate(waypoints) if waypoint.grip)
    last = max(number for number, waypoint in enumerate(waypoints) if waypoint.grip)
    assert all(waypoint.grip for waypoint in waypoints[first : last + 1])
    for before, held in ((waypoints[first - 1], waypoints[first]), (waypoints[last + 1], waypoints[last])):
        assert before.clearance == held.clearance
        np.testing.assert_allclose(before.rotation, held.rotation, atol=1e-12)
    assert waypoints[-1].clearance > 0.05


@every_plan
def test_a_held_cube_is_moved_by_small_steps(plan):
    held = [waypoint for waypoint in plan() if waypoint.grip]
    for before, after in pairwise(held):
        assert np.linalg.norm(after.position - before.position) < 0.03
        assert angle_of(after.rotation @ before.rotation.T) < np.radians(12)


@every_plan
def test_every_waypoint_takes_time_and_a_true_rotation(plan):
    for waypoint in plan():
        assert waypoint.seconds > 0
        assert waypoint.still >= 0
        np.testing.assert_allclose(waypoint.rotation @ waypoint.rotation.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(waypoint.rotation) == pytest.approx(1)


def test_pads_are_nineteen_centimetres_and_the_clearance_from_the_centre_on_either_side():
    task = Waypoint("approach", np.array([0.42, 0.0, 0.30]), np.eye(3), 0.02, 1.0).task(STILL, PADS)
    np.testing.assert_allclose(task.pad, [[0.42, 0.21, 0.30], [0.42, -0.21, 0.30]])
    np.testing.assert_allclose(task.normal, [[0, -1, 0], [0, 1, 0]])
    np.testing.assert_allclose(task.palm, [[0, 0, -1], [0, 0, -1]])


def test_hands_go_round_with_the_cube():
    position = np.array([0.42, 0.0, 0.30])
    # The left face comes to the front, and with it the left hand.
    turned = Waypoint("turn", position, about_vertical(np.pi / 2), -0.002, 1.0, flips=False).task(STILL, PADS)
    np.testing.assert_allclose(turned.pad, [[0.232, 0, 0.30], [0.608, 0, 0.30]], atol=1e-12)
    np.testing.assert_allclose(turned.normal, [[1, 0, 0], [-1, 0, 0]], atol=1e-12)
    assert turned.palm is None
    # The bottom goes to the back, and with it the palms.
    flipped = Waypoint("turn", position, towards_robot(np.pi / 2), 0.0, 1.0).task(STILL, PADS)
    np.testing.assert_allclose(flipped.pad, [[0.42, 0.19, 0.30], [0.42, -0.19, 0.30]], atol=1e-12)
    np.testing.assert_allclose(flipped.palm, [[1, 0, 0], [1, 0, 0]], atol=1e-12)


def test_what_the_pads_have_rolled_is_counted_in_the_cubes_frame():
    rolled = np.array([[0.01, 0.0, 0.003], [-0.02, 0.0, 0.0]])
    waypoint = Waypoint("turn", np.array([0.42, 0.0, 0.30]), about_vertical(np.pi / 2), 0.0, 1.0)
    np.testing.assert_allclose(waypoint.task(rolled, PADS).pad, [[0.23, 0.01, 0.303], [0.61, -0.02, 0.30]], atol=1e-12)


def test_a_yaw_lets_the_hands_lean_further_than_a_flip():
    cones = [Waypoint("", CUBE_CENTRE, np.eye(3), 0, 1, flips).task(STILL, PADS).cone for flips in (True, False)]
    assert 0 < cones[0] < cones[1] < np.pi / 2


def test_the_left_hand_presses_to_the_right_and_the_right_hand_to_the_left():
    assert INWARD.tolist() == [[0, -1, 0], [0, 1, 0]]


@pytest.mark.parametrize(
    ("ahead", "left", "degrees", "square"),
    [
        (0, 0, 0, True),
        (0.0119, -0.0119, 2.99, True),
        (0.0121, 0, 0, False),
        (0, -0.0121, 0, False),
        (0, 0, 3.01, False),
        (0, 0, -3.01, False),
        (0, 0, -2.99, True),
    ],
)
def test_a_cube_is_square_within_twelve_millimetres_and_three_degrees(ahead, left, degrees, square):
    assert standing(ahead, left, degrees).is_square is square


def test_the_height_at_which_a_cube_is_seen_does_not_matter():
    assert CubePose(CUBE_CENTRE + np.array([0, 0, 0.05]), 0.0).is_square


def followed(kinematics, waypoints, angles):
    """Solve for each way-point from the one before; return the largest miss with a grip (m) and the last angles."""
    worst = 0.0
    for waypoint in waypoints:
        solution = solve(kinematics, waypoint.task(STILL, PADS), angles, HOME_POSTURE)
        angles = solution.angles
        assert (angles >= kinematics.lower).all()
        assert (angles <= kinematics.upper).all()
        if waypoint.grip:
            worst = max(worst, solution.position_error.max())
    return worst, angles


POSES = [(0, 0, 0), (0.02, 0.02, 5), (0.02, -0.02, 5), (-0.02, 0.02, -5), (-0.02, -0.02, 5)]


@pytest.mark.parametrize(("ahead", "left", "degrees"), POSES)
def test_a_cube_two_centimetres_and_five_degrees_off_is_held_through_a_flip(kinematics, ahead, left, degrees):
    worst, _ = followed(kinematics, plans.flip(standing(ahead, left, degrees)), HOME_POSTURE)
    assert worst < 0.008


@pytest.mark.parametrize(("ahead", "left", "degrees"), POSES)
def test_a_cube_two_centimetres_and_five_degrees_off_is_held_while_it_is_squared(kinematics, ahead, left, degrees):
    worst, _ = followed(kinematics, plans.square(standing(ahead, left, degrees)), HOME_POSTURE)
    assert worst < 0.008


@pytest.mark.parametrize(("ahead", "left", "degrees"), POSES)
@pytest.mark.parametrize("direction", [LEFT, RIGHT])
def test_a_cube_two_centimetres_and_five_degrees_off_is_held_to_halfway(kinematics, direction, ahead, left, degrees):
    worst, _ = followed(kinematics, plans.turn_to_halfway(standing(ahead, left, degrees), direction), HOME_POSTURE)
    assert worst < 0.008


@pytest.mark.parametrize(("ahead", "left", "degrees"), [(0, 0, 0), (0, 0, -5), (0, 0, 5), (0.01, 0, -5), (0, 0.01, -5)])
@pytest.mark.parametrize("direction", [LEFT, RIGHT])
def test_a_cube_a_centimetre_and_five_degrees_off_is_held_from_halfway(kinematics, direction, ahead, left, degrees):
    _, angles = followed(kinematics, plans.turn_to_halfway(standing(), direction), HOME_POSTURE)
    # The mirror image of what is off for a turn to the left.
    cube = halfway(direction, ahead, direction * left, direction * degrees)
    worst, _ = followed(kinematics, plans.turn_from_halfway(cube, direction), angles)
    assert worst < 0.008


def test_all_the_poses_of_a_flip_pass_through_no_other_orientation():
    seen = [nearest_orientation(waypoint.rotation)[0] for waypoint in plans.flip(standing()) if waypoint.grip]
    assert [orientation for orientation, _ in groupby(seen)] == [0, SUCCESSORS[0][0]]
