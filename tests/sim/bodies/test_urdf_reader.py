import os
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from sim.bodies.urdf_reader import read_urdf
from tests.sim import descriptions
from tests.sim.descriptions import joint, written

WRIST = "r2/left_arm/wrist/yaw"


def link(tree, name):
    (found,) = (element for element in tree.iter("link") if element.get("name") == name)
    return found


def test_every_link_is_walked_to_after_the_one_it_hangs_on(tmp_path):
    tree = read_urdf(written(descriptions.parsed(), tmp_path))
    seen = set()
    for above, here, _ in tree.walk({}):
        assert above is None or above.parent in seen
        seen.add(here.name)
    assert seen == tree.links.keys()
    assert tree.root == "base"


def test_links_are_where_the_joints_above_them_put_them(tmp_path):
    path = tmp_path / "two.urdf"
    path.write_text(
        """<robot name="two"><link name="a"/><link name="b"/><link name="c"/>
        <joint name="/ab" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 2"/>
          <origin xyz="1 0 0" rpy="0 0 1.5707963267948966"/><limit lower="-1" upper="2"/></joint>
        <joint name="bc" type="prismatic"><parent link="b"/><child link="c"/><axis xyz="1 0 0"/>
          <origin xyz="0 1 0"/><limit lower="0" upper="1" effort="3" velocity="4"/></joint></robot>"""
    )
    tree = read_urdf(path)
    places = {here.name: pose[:3, 3] for _, here, pose in tree.walk({"ab": np.pi / 2, "bc": 0.5})}
    # b stands at (1, 0, 0), turned by half a turn; c half a metre along its −x, and one along its −y.
    np.testing.assert_allclose(places["b"], [1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(places["c"], [0.5, -1, 0], atol=1e-12)
    assert (tree.joints["bc"].effort, tree.joints["bc"].velocity) == (3, 4)
    assert (tree.joints["ab"].lower, tree.joints["ab"].upper) == (-1, 2)


def test_an_axis_need_not_be_a_unit_vector_and_is_x_if_not_told(tmp_path):
    tree = descriptions.parsed()
    joint(tree, WRIST).find("axis").set("xyz", "0 0 -2.5")
    elbow = joint(tree, "r2/left_arm/joint3")
    elbow.remove(elbow.find("axis"))
    joints = read_urdf(written(tree, tmp_path)).joints
    assert joints[WRIST].axis.tolist() == [0, 0, -1]
    assert joints["r2/left_arm/joint3"].axis.tolist() == [1, 0, 0]


def test_a_package_is_found_about_the_file_by_its_name_and_by_its_content(tmp_path, monkeypatch):
    tree = descriptions.parsed()
    for mesh in tree.iter("mesh"):
        mesh.set("filename", f"package://some_robot/meshes/{mesh.get('filename')}")
    renamed = tmp_path / "some_robot-main" / "urdf"
    elsewhere, lonely = tmp_path / "packages" / "some_robot", tmp_path / "lonely"
    for folder in (renamed, renamed.parent / "meshes", elsewhere / "meshes", lonely):
        folder.mkdir(parents=True)
    written(descriptions.parsed(), renamed.parent / "meshes")
    written(descriptions.parsed(), elsewhere / "meshes")
    path = renamed / "own.urdf"
    path.write_bytes(ElementTree.tostring(tree))
    found = {piece.attributes["filename"] for each in read_urdf(path).links.values() for piece in each.seen}
    assert found == {str(renamed.parent / "meshes" / f"{kind}.obj") for kind in ("ball", "capsule", "rounded")}
    alone = lonely / "own.urdf"
    alone.write_bytes(ElementTree.tostring(tree))
    refused(alone, "is no file in the folders about it")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(elsewhere.parent))
    assert read_urdf(alone).links


def refused(path, message):
    with pytest.raises(InvalidInputError, match=message) as caught:
        read_urdf(path)
    assert str(caught.value).startswith(f"{path}: ")


def test_a_file_that_is_not_there_is_refused(tmp_path):
    refused(tmp_path / "nowhere.urdf", "cannot be read as URDF: no such file")


def test_a_folder_is_refused(tmp_path):
    refused(tmp_path, "cannot be read as URDF")


@pytest.mark.parametrize("content", ["", "solid cube", "<robot><link></robot>"])
def test_a_file_that_is_not_xml_is_refused(tmp_path, content):
    path = Path(tmp_path / "broken.urdf")
    path.write_text(content)
    refused(path, "cannot be read as URDF: .*; expected a robot's description")


@pytest.mark.parametrize(
    "numbers",
    ["1 2", "1 2 3 4", "left right up", "0.1, 0.2, 0.3", "nan 0 0", "inf 0 0", "0 -1e30 0", "1e308 1e308 1e308"],
)
@pytest.mark.parametrize(("element", "attribute"), [("origin", "xyz"), ("origin", "rpy"), ("axis", "xyz")])
def test_a_vector_that_is_not_three_numbers_is_refused(tmp_path, element, attribute, numbers):
    tree = descriptions.parsed()
    joint(tree, WRIST).find(element).set(attribute, numbers)
    refused(written(tree, tmp_path), "three finite numbers|could not convert string to float")


def test_a_limit_that_is_not_a_number_is_refused(tmp_path):
    tree = descriptions.parsed()
    joint(tree, WRIST).find("limit").set("upper", "far")
    refused(written(tree, tmp_path), "could not convert string to float: 'far'")


def test_a_joint_that_hangs_on_nothing_is_refused(tmp_path):
    tree = descriptions.parsed()
    joint(tree, WRIST).remove(joint(tree, WRIST).find("parent"))
    refused(written(tree, tmp_path), f"joint {WRIST} has no parent")


def test_joints_that_go_round_in_a_circle_are_refused(tmp_path):
    tree = descriptions.parsed()
    joint(tree, WRIST).find("child").set("link", "base")
    refused(written(tree, tmp_path), "its joints go round in a circle")


@pytest.mark.parametrize(
    ("element", "attribute", "value", "message"),
    [
        ("mass", "value", "-2", "link .* has a mass of -2.0 kg"),
        ("mass", "value", "nan", "value is nan"),
        ("inertia", "ixx", "-0.1", "negative moment of inertia"),
        ("inertia", "izz", "inf", "izz is inf"),
    ],
)
def test_masses_and_inertias_that_no_body_has_are_refused(tmp_path, element, attribute, value, message):
    tree = descriptions.parsed()
    link(tree, f"{WRIST}_link").find(f"inertial/{element}").set(attribute, value)
    refused(written(tree, tmp_path), message)


@pytest.mark.parametrize(
    ("kind", "attributes", "message"),
    [
        ("sphere", {"radius": "-1"}, "a sphere whose radius is '-1'"),
        ("sphere", {}, "a sphere whose radius is None"),
        ("box", {"size": "1 2"}, "a box whose size is '1 2'"),
        ("cylinder", {"radius": "1", "length": "inf"}, "a cylinder whose length is 'inf'"),
        ("plane", {}, "a shape that is 'plane'"),
        ("mesh", {"filename": "nowhere.stl"}, "mesh 'nowhere.stl' is no file"),
        ("mesh", {"filename": "ball.obj", "scale": "1 1"}, "not three finite numbers"),
    ],
)
def test_shapes_that_are_none_are_refused(tmp_path, kind, attributes, message):
    tree = descriptions.parsed()
    geometry = tree.find(".//collision/geometry")
    geometry.clear()
    ElementTree.SubElement(geometry, kind, attributes)
    refused(written(tree, tmp_path), message)


@pytest.mark.parametrize("tag", ["link", "joint"])
def test_names_that_are_too_long_for_pybullet_are_refused(tmp_path, tag):
    tree = descriptions.parsed()
    element = tree.find(tag)
    element.set("name", "n" * 5000)
    refused(written(tree, tmp_path), f"a {tag} whose name has 5000 characters, not 1 to 200")


def test_a_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.stl")
    tree = descriptions.parsed()
    tree.find(".//mesh").set("filename", "pipe.stl")
    refused(written(tree, tmp_path), "mesh 'pipe.stl' is no file")
    os.mkfifo(tmp_path / "pipe.urdf")
    refused(tmp_path / "pipe.urdf", "not a plain file")


def test_a_joint_on_a_link_that_is_not_there_is_refused(tmp_path):
    tree = descriptions.parsed()
    joint(tree, WRIST).find("parent").set("link", "nowhere")
    refused(written(tree, tmp_path), f"joint {WRIST} names the link 'nowhere', which is not there")


def test_two_links_of_one_name_are_refused(tmp_path):
    tree = descriptions.parsed()
    ElementTree.SubElement(tree, "link", name="base")
    refused(written(tree, tmp_path), "a joint or a link is there twice")
