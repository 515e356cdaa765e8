import ctypes
from xml.etree import ElementTree

import numpy as np
import pybullet
import pytest

from sim.bodies.robonaut_joints import NECK, SIDES, WAIST, arm
from sim.bodies.robot_mapping import shell_mapping
from sim.bodies.robot_model import fitted
from sim.bodies.urdf_reader import read_urdf
from sim.bodies.urdf_writer import robot_urdf, write_robot
from tests.sim import descriptions

TABLE = {joint.name: joint for joint in (WAIST, *NECK, *arm("left"), *arm("right"))}


def complaints(client, path, capfd):
    """Load a description, and return what PyBullet prints about it."""
    capfd.readouterr()
    pybullet.loadURDF(str(path), flags=pybullet.URDF_USE_INERTIA_FROM_FILE, physicsClientId=client)
    ctypes.CDLL(None).fflush(None)
    return "".join(capfd.readouterr())


def test_what_is_written_is_read_back_as_the_table(tmp_path):
    model = fitted(read_urdf(write_robot(tmp_path)), shell_mapping())
    assert set(model.joints) == set(shell_mapping().moved)
    assert not model.notes
    for name in model.joints:
        joint = TABLE[name]
        read = model.joints[name]
        np.testing.assert_allclose(read.position, joint.position, atol=1e-9)
        np.testing.assert_allclose(read.axis, joint.axis, atol=1e-9)
        assert (read.lower, read.upper) == pytest.approx((joint.lower, joint.upper), abs=1e-9)


def test_speeds_and_torques_are_written_as_the_table_has_them():
    tree = ElementTree.fromstring(robot_urdf())
    for name, joint in TABLE.items():
        limit = descriptions.joint(tree, name).find("limit")
        assert (float(limit.get("velocity")), float(limit.get("effort"))) == (joint.velocity, joint.effort)


def test_every_link_has_a_mass_and_an_inertia_that_a_body_can_have():
    links = list(ElementTree.fromstring(robot_urdf()).iter("link"))
    assert len(links) == 1 + len(TABLE)
    for link in links:
        inertial = link.find("inertial")
        assert float(inertial.find("mass").get("value")) > 0
        inertia = inertial.find("inertia")
        assert [inertia.get(name) for name in ("ixy", "ixz", "iyz")] == ["0"] * 3
        a, b, c = sorted(float(inertia.get(name)) for name in ("ixx", "iyy", "izz"))
        assert a > 0
        assert a + b >= c


def test_links_have_the_masses_of_the_table():
    masses = {
        link.get("name"): float(link.find("inertial/mass").get("value"))
        for link in ElementTree.fromstring(robot_urdf()).iter("link")
    }
    assert {f"{name}_link": joint.mass for name, joint in TABLE.items()}.items() <= masses.items()


def test_pybullet_loads_it_without_complaint(client, tmp_path, capfd):
    assert complaints(client, write_robot(tmp_path), capfd) == ""


def test_a_link_without_inertia_would_be_complained_about(client, tmp_path, capfd):
    tree = descriptions.parsed()
    link = tree.find("link")
    link.remove(link.find("inertial"))
    assert "No inertial data for link" in complaints(client, descriptions.written(tree, tmp_path), capfd)


def test_the_arms_hang_on_the_waist_and_every_link_on_the_one_before():
    tree = ElementTree.fromstring(robot_urdf())
    for side in SIDES:
        parent = f"{WAIST.name}_link"
        for joint in arm(side):
            element = descriptions.joint(tree, joint.name)
            assert element.find("parent").get("link") == parent
            parent = element.find("child").get("link")


def test_only_hands_arms_torso_and_head_can_be_touched():
    solid = {
        link.get("name").removesuffix("_link")
        for link in ElementTree.fromstring(robot_urdf()).iter("link")
        if link.find("collision") is not None
    }
    touched = {WAIST.name, NECK[-1].name}
    touched |= {f"r2/{side}_arm/{name}" for side in SIDES for name in ("joint2", "joint4", "wrist/yaw")}
    assert solid == touched


def test_meshes_lie_beside_the_description(tmp_path):
    tree = ElementTree.parse(write_robot(tmp_path))
    meshes = {mesh.get("filename") for mesh in tree.iter("mesh")}
    assert meshes == {"ball.obj", "capsule.obj", "rounded.obj"}
    for mesh in meshes:
        lines = (tmp_path / mesh).read_text().splitlines()
        corners = np.array([line.split()[1:] for line in lines if line.startswith("v ")], dtype=float)
        np.testing.assert_allclose(corners.max(axis=0), 1, atol=1e-5)
        np.testing.assert_allclose(corners.min(axis=0), -1, atol=1e-5)
        named = {int(corner.split("/")[0]) for line in lines if line.startswith("f ") for corner in line.split()[1:]}
        assert named == set(range(1, len(corners) + 1))


def test_the_mesh_of_a_ball_is_round(tmp_path):
    write_robot(tmp_path)
    lines = (tmp_path / "ball.obj").read_text().splitlines()
    corners, normals = (
        np.array([line.split()[1:] for line in lines if line.startswith(kind)], dtype=float) for kind in ("v ", "vn ")
    )
    np.testing.assert_allclose(np.linalg.norm(corners, axis=1), 1, atol=2e-5)
    np.testing.assert_allclose(normals, corners, atol=2e-5)
    faces = [line.split()[1:] for line in lines if line.startswith("f ")]
    for face in faces:
        a, b, c = (corners[int(corner.split("/")[0]) - 1] for corner in face)
        # At the poles a triangle has no area.
        assert np.cross(b - a, c - a) @ (a + b + c) >= -1e-9
