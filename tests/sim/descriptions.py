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
