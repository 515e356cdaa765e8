import sysconfig
from pathlib import Path

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError
from sim.bodies.robonaut_joints import ARM_AXIS, SIDES, arm_joint_names, mirrored
from sim.bodies.robot_mapping import read_mapping, shell_mapping
from sim.bodies.robot_model import fitted
from sim.bodies.urdf_reader import read_urdf
from tests.sim import descriptions
from tests.sim.descriptions import written

BAXTER = Path(__file__).parents[3] / "docs" / "baxter.toml"


def told(**changes):
    """A mapping of the shell, as TOML; ``None`` leaves a key out."""
    keys = {"urdf": '"own.urdf"', "name": '"Own"', **changes}
    lines = [f"{key} = {value}" for key, value in keys.items() if value is not None and "_" not in key]
    lines += [f"{key.strip('_')} = {value}" for key, value in keys.items() if value is not None and "_" in key]
    for side in SIDES:
        lines += [f"[{side}]", f"joints = {list(arm_joint_names(side))}", f'hand = "r2/{side}_arm/wrist/yaw_link"']
        lines += [f"forward = {mirrored(2 * ARM_AXIS, side).tolist()}", "palm = [0, 0, -1]"]
    return "\n".join(lines).replace("'", '"')


def mapping_of(folder, text):
    path = folder / "own.toml"
    path.write_text(text)
    return read_mapping(path)


def test_a_mapping_tells_the_arms_of_the_description_beside_it(tmp_path):
    path = written(descriptions.parsed(), tmp_path)
    urdf, mapping = mapping_of(tmp_path, told())
    assert urdf == path
    model, shell = fitted(read_urdf(urdf), mapping), fitted(read_urdf(urdf), shell_mapping())
    assert model.joints.keys() == shell.joints.keys()
    for name, frame in model.joints.items():
        np.testing.assert_allclose(frame.position, shell.joints[name].position, atol=1e-9)
        assert frame.velocity == shell.joints[name].velocity
    np.testing.assert_allclose(model.mapping.forward, shell.mapping.forward, atol=1e-9)
    np.testing.assert_allclose(model.mapping.palm, shell.mapping.palm, atol=1e-9)


def test_hands_point_the_same_way_in_whatever_frame_their_links_have(tmp_path):
    """A link turned by a quarter about x, in whose frame the robot's down is its y."""
    tree = descriptions.parsed()
    frame = descriptions.hung(tree, "tool", "r2/left_arm/wrist/yaw_link", "fixed", 0.0)
    descriptions.joint(tree, "tool").append(descriptions.origin(rpy=(np.pi / 2, 0, 0)))
    written(tree, tmp_path)
    text = told().replace('hand = "r2/left_arm/wrist/yaw_link"', f'hand = "{frame.get("name")}"')
    x, y, _ = ARM_AXIS.tolist()
    text = text.replace(
        f"forward = {(2 * ARM_AXIS).tolist()}\npalm = [0, 0, -1]", f"forward = [{x}, 0, {-y}]\npalm = [0, -1, 0]", 1
    )
    urdf, mapping = mapping_of(tmp_path, text)
    hands = fitted(read_urdf(urdf), mapping).mapping
    np.testing.assert_allclose(hands.forward, shell_mapping().forward, atol=1e-9)
    np.testing.assert_allclose(hands.palm, shell_mapping().palm, atol=1e-9)


def test_all_that_may_be_told_is_taken(tmp_path):
    numbers = [1, 2, 3, 4, 5, 6, 7]
    text = told(
        waist='"r2/waist/joint0"',
        shoulders=[-0.1, 0, 0.6],
        eye=[0, 0, 0.9],
        velocity=numbers,
        effort=numbers,
        rotor_inertia=numbers,
        held='{"r2/neck/*" = 0.1}',
    )
    _, mapping = mapping_of(tmp_path, text)
    assert mapping.waist == "r2/waist/joint0"
    assert mapping.held == {"r2/neck/*": 0.1}
    assert (mapping.shoulders.tolist(), mapping.eye.tolist()) == ([-0.1, 0, 0.6], [0, 0, 0.9])
    assert mapping.velocity.tolist() == mapping.effort.tolist() == mapping.rotor_inertia.tolist() == numbers


def test_a_description_of_an_installed_package_is_found_there():
    urdf, mapping = read_mapping(BAXTER)
    assert (
        urdf.parts[: len(Path(sysconfig.get_paths()["purelib"]).parts)] == Path(sysconfig.get_paths()["purelib"]).parts
    )
    assert urdf.name == "baxter.urdf"
    assert mapping.name == "Baxter"
    assert [len(arm) for arm in mapping.arms] == [7, 7]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("urdf = ", "cannot be read as a mapping"),
        ('urdf = "a"\nname = "b"', "has not exactly forward, hand, joints, palm"),
        (told(urdf=None), "urdf: None is not a name"),
        (told(name="3"), "name: 3 is not a name"),
        (told(colour='"red"'), "colour: not one of effort, eye, held"),
        (told(eye=[1, 2]), r"eye: \[1, 2\] is not a list of 3 finite numbers"),
        (told(eye='["a", 2, 3]'), "is not a list of 3 finite numbers"),
        (told(shoulders="[nan, 0, 0]"), "is not a list of 3 finite numbers"),
        (told(effort=[0] * 7), "effort: .* are not all above 0"),
        (told(held="[1]"), r"held: \[1\] is not a table"),
        (told(held='{"a" = "b"}'), "is not a table of joints and angles"),
        (told().replace("palm = [0, 0, -1]", "palm = [0, 0, 0]"), "palm: .* has no direction"),
        (told().replace('"r2/left_arm/joint0", ', ""), r"\[left\] joints: .* is not a list of 7 names"),
    ],
)
def test_what_is_no_mapping_is_refused(tmp_path, text, message):
    with pytest.raises(InvalidInputError, match=message) as caught:
        mapping_of(tmp_path, text)
    assert str(caught.value).startswith(f"{tmp_path / 'own.toml'}: ")


def test_a_mapping_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(InvalidInputError, match="no such file"):
        read_mapping(tmp_path / "nowhere.toml")


def test_a_link_of_a_hand_that_is_not_there_is_refused(tmp_path):
    written(descriptions.parsed(), tmp_path)
    urdf, mapping = mapping_of(tmp_path, told().replace("r2/left_arm/wrist/yaw_link", "claw"))
    with pytest.raises(InvalidInputError, match="it has no link claw"):
        fitted(read_urdf(urdf), mapping)


@pytest.mark.parametrize("value", ["1" + "0" * 400, "inf", "true"])
def test_a_number_that_no_machine_can_hold_is_refused(value, tmp_path):
    with pytest.raises(InvalidInputError, match="expected a mapping"):
        mapping_of(tmp_path, told(shoulders=f"[0, {value}, 0]"))


def test_lists_in_lists_without_end_are_no_toml(tmp_path):
    with pytest.raises(InvalidInputError, match="expected TOML"):
        mapping_of(tmp_path, told(shoulders="[" * 3000))
