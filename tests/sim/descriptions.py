"""The robot's own description, changed as users' files differ from it."""

from xml.etree import ElementTree

import cv2
import numpy as np

from sim.bodies.urdf_writer import robot_urdf, write_robot

MOUNT_OFFSET, MOUNT_ANGLES = (0.3, -0.2, 0.5), (1.57, -0.4, 0.3)


def parsed():
    return ElementTree.fromstring(robot_urdf())


def joint(tree, name):
    (found,) = (element for element in tree.iter("joint") if element.get("name") == name)
    return found


def written(tree, folder):
    """Write a description with the meshes it names beside it."""
    path = write_robot(folder).with_name("own.urdf")
    path.write_bytes(ElementTree.tostring(tree))
    return path


def vector(text):
    return np.array([float(number) for number in text.split()])


def text(vector):
    return " ".join(f"{number:.17g}" for number in vector)


def slashed(tree):
    for element in tree.iter("joint"):
        element.set("name", "/" + element.get("name"))
    return tree


def mounted(tree):
    """Hang the robot on a new root, lying on its side."""
    root = ElementTree.SubElement(tree, "link", name="mounting plate")
    inertial = ElementTree.SubElement(root, "inertial")
    ElementTree.SubElement(inertial, "mass", value="1")
    ElementTree.SubElement(inertial, "inertia", ixx="1", iyy="1", izz="1", ixy="0", ixz="0", iyz="0")
    mount = ElementTree.SubElement(tree, "joint", name="mount", type="fixed")
    ElementTree.SubElement(mount, "parent", link="mounting plate")
    ElementTree.SubElement(mount, "child", link="base")
    ElementTree.SubElement(mount, "origin", xyz=text(MOUNT_OFFSET), rpy=text(MOUNT_ANGLES))
    return tree


def with_a_turned_frame(tree, turned, child):
    """Turn the frame of a joint, and with it all that is told in that frame."""
    angles = (0.3, -0.5, 1.1)
    x, y, z = (cv2.Rodrigues(angle * axis)[0] for angle, axis in zip(angles, np.eye(3), strict=True))
    rotation = z @ y @ x
    back = np.arctan2(rotation[1, 2], rotation[2, 2]), -np.arcsin(rotation[0, 2]), np.arctan2(*rotation[0, 1::-1])
    turned, child = joint(tree, turned), joint(tree, child)
    turned.find("origin").set("rpy", text(angles))
    turned.find("axis").set("xyz", text(rotation.T @ vector(turned.find("axis").get("xyz"))))
    child.find("origin").set("xyz", text(rotation.T @ vector(child.find("origin").get("xyz"))))
    child.find("origin").set("rpy", text(back))
    return tree


def with_a_flipped_waist(tree):
    """Hang all upside down, with a waist that turns about an axis that points down, as NASA's files have it."""
    waist = joint(tree, "r2/waist/joint0")
    waist.find("axis").set("xyz", "0 0 -1")
    for element in tree.iter("joint"):
        if element.find("parent").get("link") == "base":
            element.find("origin").set("rpy", text((np.pi, 0.0, 0.0)))
    return tree


def with_turned_axes(tree, *names):
    """Let joints turn the other way, limits and all."""
    for name in names:
        axis, limit = joint(tree, name).find("axis"), joint(tree, name).find("limit")
        axis.set("xyz", text(-vector(axis.get("xyz"))))
        lower, upper = limit.get("lower"), limit.get("upper")
        limit.set("lower", text([-float(upper)]))
        limit.set("upper", text([-float(lower)]))
    return tree


def with_token_masses(tree, *names):
    """Give links the values that stand where nobody measured."""
    for link in tree.iter("link"):
        if link.get("name") in names:
            link.find("inertial/mass").set("value", "0.01")
            link.find("inertial/inertia").attrib.update(dict.fromkeys(("ixx", "iyy", "izz"), "0.0001"))
    return tree


def hung(tree, name, parent, kind, upper):
    """Hang a link with a small ball on another by a joint about x."""
    link = ElementTree.SubElement(tree, "link", name=f"{name} (link)")
    geometry = ElementTree.SubElement(ElementTree.SubElement(link, "collision"), "geometry")
    ElementTree.SubElement(geometry, "sphere", radius="0.005")
    element = ElementTree.SubElement(tree, "joint", name=name, type=kind)
    ElementTree.SubElement(element, "parent", link=parent)
    ElementTree.SubElement(element, "child", link=f"{name} (link)")
    ElementTree.SubElement(element, "axis", xyz="1 0 0")
    ElementTree.SubElement(element, "limit", lower="0", upper=f"{upper:g}", effort="1", velocity="1")
    return link


def with_legs(tree, joints_a_leg=7):
    """Stand the robot on two legs that end in grippers, on a base that floats, as those for space do."""
    world = ElementTree.SubElement(tree, "link", name="world")
    floats = ElementTree.SubElement(tree, "joint", name="floating base", type="floating")
    ElementTree.SubElement(floats, "parent", link=world.get("name"))
    ElementTree.SubElement(floats, "child", link="base")
    for side in ("left", "right"):
        above = "base"
        for number in range(joints_a_leg):
            leg = hung(tree, f"r2/{side}_leg/joint{number}", above, "revolute", 1.5)
            ElementTree.SubElement(ElementTree.SubElement(leg, "inertial"), "mass", value="0.01")
            above = leg.get("name")
        for jaw in range(2):
            hung(tree, f"r2/{side}_leg/gripper/jaw{jaw}", above, "prismatic", 0.02)
    return tree


def with_fists_of_boxes(tree):
    """Give both hands a palm and four fingers bent into it, and no pad."""
    for side, outwards in (("left", 1.0), ("right", -1.0)):
        (hand,) = (link for link in tree.iter("link") if link.get("name") == f"r2/{side}_arm/wrist/yaw_link")
        for collision in list(hand.iterfind("collision")):
            hand.remove(collision)
        along, across = (
            np.array([np.sin(0.2618), np.cos(0.2618), 0.0]),
            np.array([np.cos(0.2618), -np.sin(0.2618), 0.0]),
        )
        turn = text((0.0, 0.0, -0.2618 * outwards))
        palm = ElementTree.SubElement(hand, "collision")
        ElementTree.SubElement(palm, "origin", xyz=text(0.06 * along * [1, outwards, 1]), rpy=turn)
        ElementTree.SubElement(ElementTree.SubElement(palm, "geometry"), "box", size="0.08 0.10 0.035")
        for finger in range(4):
            place = 0.112 * along + (0.033 - 0.022 * finger) * across - [0.0, 0.0, 0.012]
            knuckle = ElementTree.SubElement(hand, "collision")
            ElementTree.SubElement(knuckle, "origin", xyz=text(place * [1, outwards, 1]))
            ElementTree.SubElement(
                ElementTree.SubElement(knuckle, "geometry"), "capsule", radius="0.012", length="0.03"
            )
    return tree


def origin(rpy):
    return ElementTree.Element("origin", rpy=text(rpy))


def like_nasas():
    """The shell with all in which NASA's own files differ from it."""
    turned = [f"r2/right_arm/{name}" for name in ("joint0", "joint2", "joint4", "wrist/yaw")]
    tokens = [f"r2/{side}_arm/wrist/{name}_link" for side in ("left", "right") for name in ("pitch", "yaw")]
    tree = with_fists_of_boxes(parsed())
    return with_a_flipped_waist(with_token_masses(with_turned_axes(tree, *turned), *tokens))
