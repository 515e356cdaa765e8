"""Where a box stands, told from depth alone: against images that are computed from the poses, ray by ray."""

import itertools

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from sim.vision.box_pose import turned
from sim.vision.camera import Camera
from sim.vision.cuboid_fit import find_tabletop, points_of
from sim.vision.depth_noise import noisy_depth

CAMERA = Camera(field_of_view=50.0, image_size=(400, 300))
TABLE = 0.16
CUBE = (0.28, 0.28, 0.28)


def depth_image(centre=None, yaw=0.0, size=CUBE, table=TABLE, slope=0.0, camera=CAMERA):
    """Return the depth of a table (60 cm square, rising by ``slope`` along y) and of a box on it, if there is one."""
    rays = camera.rays.reshape(-1, 3) @ camera.rotation.T
    eye = np.array(camera.eye)
    normal = np.array([0.0, -slope, 1.0])
    depth = (table - normal @ eye) / (rays @ normal)
    hit = eye + depth[:, None] * rays
    depth[(depth < 0) | (np.abs(hit[:, 0] - 0.5) > 0.3) | (np.abs(hit[:, 1]) > 0.3)] = 0.0
    if centre is not None:
        # The slab method: a ray is inside where it is between all three pairs of faces.
        own, start = rays @ turned(yaw), (eye - centre) @ turned(yaw)
        with np.errstate(divide="ignore"):
            ends = np.stack([(side * np.array(size) / 2 - start) / own for side in (-1, 1)])
        enter, leave = ends.min(axis=0).max(axis=1), ends.max(axis=0).min(axis=1)
        inside = (enter < leave) & (enter > 0)
        depth[inside] = enter[inside]
    return depth.reshape(camera.image_size[::-1]).astype(np.float32)


def found_in(depth):
    return find_tabletop(points_of(depth, CAMERA)).box


def errors(found, centre, yaw):
    """Return the errors of position, m, and angle, degrees; a box looks the same after a quarter turn."""
    turn = (found.yaw - yaw + np.pi / 4) % (np.pi / 2) - np.pi / 4
    return np.abs(found.centre - centre), abs(np.degrees(turn))


def poses(n, seed=0):
    rng = np.random.default_rng(seed)
    for _ in range(n):
        yield np.array([*rng.uniform((0.36, -0.03), (0.45, 0.03)), 0.30]), np.radians(rng.uniform(-45, 45))


def test_without_noise_poses_are_right_to_a_millimetre():
    for centre, yaw in poses(6):
        position, angle = errors(found_in(depth_image(centre, yaw)), centre, yaw)
        assert position.max() < 0.002
        assert angle < 0.25


def test_with_the_noise_of_a_depth_camera_they_are_right_to_millimetres():
    rng, of_position, of_angle, of_size = np.random.default_rng(1), [], [], []
    for centre, yaw in poses(12, seed=1):
        found = found_in(noisy_depth(depth_image(centre, yaw), CAMERA.intrinsics[0, 0], 1.0, rng))
        position, angle = errors(found, centre, yaw)
        of_position.append(position)
        of_angle.append(angle)
        of_size.append(np.abs(found.size - CUBE).max())
    assert np.mean(of_position) < 0.0015
    assert np.max(of_position) < 0.006
    assert np.mean(of_angle) < 0.3
    assert np.max(of_angle) < 1.0
    assert np.max(of_size) < 0.012


@pytest.mark.parametrize("size", list(itertools.permutations((0.12, 0.20, 0.28))))
def test_the_size_of_a_box_is_told_whatever_it_is(size):
    centre = np.array([0.42, 0.01, TABLE + size[2] / 2])
    for yaw in np.radians((-40.0, 0.0, 25.0)):
        found = found_in(depth_image(centre, yaw, size))
        np.testing.assert_allclose(found.size, size, atol=0.004)
        np.testing.assert_allclose(found.centre, centre, atol=0.002)
        assert abs(found.yaw - yaw) < np.radians(0.5)


@pytest.mark.parametrize(("table", "slope"), [(0.05, 0.0), (0.22, 0.0), (TABLE, 0.05)])
def test_neither_the_height_of_the_table_nor_its_lean_is_taken_for_granted(table, slope):
    centre = np.array([0.42, 0.0, table + 0.07])
    found = found_in(depth_image(centre, 0.1, (0.2, 0.2, 0.14), table, slope))
    assert np.abs(found.centre - centre).max() < 0.004


def test_a_table_with_nothing_on_it_has_no_box():
    seen = find_tabletop(points_of(depth_image(), CAMERA))
    assert seen.box is None
    assert seen.table.sum() == (depth_image() > 0).sum()


def test_a_box_that_is_not_whole_in_the_image_is_none():
    assert found_in(depth_image(np.array([0.42, 0.45, 0.30]))) is None


def test_points_far_above_the_table_that_are_no_plane_are_no_box():
    cloud = points_of(depth_image(), CAMERA)
    cloud[100:160, 150:220, 2] += np.random.default_rng(0).uniform(0.05, 0.5, (60, 70))
    assert find_tabletop(cloud).box is None


def test_the_table_is_told_from_what_stands_on_it():
    depth = depth_image(np.array([0.42, 0.0, 0.30]))
    table = find_tabletop(points_of(depth, CAMERA)).table
    assert (table == (depth == depth_image()) & (depth > 0)).mean() > 0.99


@pytest.mark.parametrize(
    ("depth", "message"),
    [
        (np.zeros((300, 400), dtype=np.float32), "depth: nothing was measured in 120000 pixels"),
        (np.full((300, 400), np.nan), "depth: nothing was measured"),
        (np.full((300, 400), -1.0), "depth: nothing was measured"),
        (np.ones((300, 400), dtype=np.uint8), r"depth: shape \(300, 400\) of uint8; expected floats"),
        (np.ones((240, 320)), r"depth: shape \(240, 320\) of float64; expected floats of shape \(300, 400\), m"),
        (np.ones((300, 400, 3)), r"depth: shape \(300, 400, 3\)"),
        ("no image", r"depth: shape \(\) of str"),
    ],
)
def test_what_is_no_depth_image_is_refused_in_one_line(depth, message):
    with pytest.raises(InvalidInputError, match=message) as refused:
        points_of(depth, CAMERA)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("points", [None, "cloud", np.zeros((30, 40)), np.zeros((30, 40, 4)), [[1.0, 2.0, 3.0]]])
def test_what_are_no_points_is_refused_in_one_line(points):
    with pytest.raises(InvalidInputError, match=r"points: .*; expected .* m$") as refused:
        find_tabletop(points)
    assert "\n" not in str(refused.value)


def test_infinite_and_missing_depths_are_left_out():
    depth = depth_image(np.array([0.42, 0.0, 0.30]))
    depth[::7] = np.nan
    depth[3::7] = np.inf
    depth[5, ::50], depth[6, ::50] = 1e30, -np.inf  # of which a height would be more bins than there is memory for
    position, angle = errors(found_in(depth), np.array([0.42, 0.0, 0.30]), 0.0)
    assert position.max() < 0.006
    assert angle < 1.0
