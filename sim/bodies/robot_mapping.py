"""Which joints of a description are the arms, and how its hands point: all that a robot needs to be known by."""

from __future__ import annotations

import os
import sys
import sysconfig
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, cast

import numpy as np

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray
from sim.bodies.robonaut_joints import ARM_AXIS, N_ARM_JOINTS, NECK, SIDES, WAIST, arm, arm_joint_names, mirrored
from sim.bodies.robonaut_shapes import EYE

_MOST_BYTES: Final = 100_000
_INSTALLED: Final = "site-packages:"
_HAND_KEYS: Final = {"joints", "hand", "forward", "palm"}
_KEYS: Final = {
    *("urdf", "name", "waist", "held", "shoulders", "eye", "velocity", "effort", "rotor_inertia"),
    *SIDES,
}
#: Where the middle between the shoulders stands in the robot's frame if nothing is said, m: Robonaut's.
SHOULDERS: Final = np.array([-0.0255, 0.0, 0.5443])
#: Leant back, looking down at the table, rad; NASA's as far back as it goes, to see past its chin.
_NECK_POSTURE: Final = (0.10, 0.0, -0.65)
_NASA_NECK_POSTURE: Final = (0.175, 0.0, -0.65)
#: Bent, they make a fist.
_FINGERS: Final = ("r2/*_arm/hand/*/proximal", "r2/*_arm/hand/*/medial", "r2/*_arm/hand/ringlittle/*")
#: NASA's trunk is deeper than the shell's, so it stands further back, m.
_NASA_PLACE: Final = np.array([-0.08, 0.0, 0.0])
#: On NASA's forehead, m: its own cameras, 6 cm further ahead, look too slantwise at the cube's front.
_FOREHEAD: Final = np.array([0.004, 0.0, 0.913])


@dataclass(frozen=True, eq=False)
class RobotMapping:
    """What is what in a description; sides are left before right, joints from the shoulder to the wrist.

    Attributes:
        arms: Names of the joints of each arm.
        forward: Unit vector out of each hand, to the face that it presses, shape [2, 3].
        palm: Unit vector normal to each palm, shape [2, 3].
        name: Of the robot, for people.
        hands: Names of the links in whose frames these vectors are; without them it is the robot's frame at joint
            angles zero.
        waist: Name of the joint that the trunk turns about, if it has one: its axis is upright.
        held: Positions of other joints, by patterns of their names as shells have them; all others stay at zero.
        shoulders: Where the middle between both arms' first joints stands in the robot's frame, shape [3], m.
        velocity: Greatest speed of each joint, where the file has no lower one, shape [joints], rad/s.
        effort: Greatest torque of each joint, where the file has no lower one, shape [joints], N·m.
        rotor_inertia: Least moment of inertia of each link: its motor's rotor, seen through the gear, shape [joints],
            kg·m².
        eye: Where the camera is in the robot's frame, shape [3], m; it looks at the cube.
    """

    arms: tuple[tuple[str, ...], tuple[str, ...]]
    forward: FloatArray
    palm: FloatArray
    name: str = "a robot with two arms"
    hands: tuple[str, str] | None = None
    waist: str | None = None
    held: Mapping[str, float] = field(default_factory=dict)
    shoulders: FloatArray = field(default_factory=lambda: SHOULDERS)
    velocity: FloatArray = field(default_factory=lambda: np.array([np.inf] * 7))
    effort: FloatArray = field(default_factory=lambda: np.array([np.inf] * 7))
    rotor_inertia: FloatArray = field(default_factory=lambda: np.array([0.03] * 7))
    eye: FloatArray = field(default_factory=lambda: EYE)

    @property
    def moved(self) -> tuple[str, ...]:
        """Names of the joints that stay joints; all others are held."""
        return (*self.arms[0], *self.arms[1])

    @property
    def named(self) -> tuple[str, ...]:
        """Names of the joints that must be there."""
        return self.moved if self.waist is None else (self.waist, *self.moved)


def read_mapping(path: Path) -> tuple[Path, RobotMapping]:
    """Read a mapping from a TOML file; return the path of the description that it names, and the mapping.

    The description is looked for beside the file, or, after ``site-packages:``, among the installed Python packages.

    Raises:
        InvalidInputError: The file cannot be read, or is no mapping.
    """
    try:
        if not os.path.isfile(path) or path.stat().st_size > _MOST_BYTES:
            raise OSError("not a plain file" if os.path.exists(path) else "no such file")
        told = tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InvalidInputError(f"{path}: cannot be read as a mapping: {error}; expected TOML") from error
    try:
        return _description_named(_text(told, "urdf"), path), _mapping(told)
    except ValueError as error:
        raise InvalidInputError(f"{path}: {error}; expected a mapping as in docs/simulation.md") from error


def _description_named(name: str, mapping: Path) -> Path:
    installed = name.removeprefix(_INSTALLED)
    return mapping.parent / name if installed == name else Path(sysconfig.get_paths()["purelib"]) / installed


def _mapping(told: dict[str, Any]) -> RobotMapping:
    """Return what a mapping file tells, or raise ``ValueError``."""
    unknown = told.keys() - _KEYS
    if unknown:
        raise ValueError(f"{min(unknown)}: not one of {', '.join(sorted(_KEYS))}")
    sides = [told.get(side) for side in SIDES]
    for side, hand in zip(SIDES, sides, strict=True):
        if not isinstance(hand, dict) or hand.keys() != _HAND_KEYS:
            raise ValueError(f"[{side}]: {hand!r} has not exactly {', '.join(sorted(_HAND_KEYS))}")
    left, right = cast(list[dict[str, Any]], sides)
    arms = tuple(_joints(hand, side) for side, hand in zip(SIDES, (left, right), strict=True))
    vectors = {key: np.array([_unit(left, key), _unit(right, key)]) for key in ("forward", "palm")}
    return RobotMapping(
        arms=(arms[0], arms[1]),
        **vectors,
        name=_text(told, "name"),
        hands=(_text(left, "hand"), _text(right, "hand")),
        waist=_text(told, "waist") if "waist" in told else None,
        held=_positions(told.get("held", {})),
        **{key: _numbers(told, key, 3) for key in ("shoulders", "eye") if key in told},
        **{key: _positive(told, key) for key in ("velocity", "effort", "rotor_inertia") if key in told},
    )


def _joints(hand: dict[str, Any], side: str) -> tuple[str, ...]:
    names = hand["joints"]
    whole = isinstance(names, list) and all(isinstance(name, str) for name in names)
    if not whole or len(names) != N_ARM_JOINTS or len(set(names)) < len(names):
        raise ValueError(f"[{side}] joints: {names!r} is not a list of {N_ARM_JOINTS} names")
    return tuple(names)


def _positions(held: Any) -> dict[str, float]:
    if not isinstance(held, dict) or not all(_is_number(value) for value in held.values()):
        raise ValueError(f"held: {held!r} is not a table of joints and angles")
    return {name: float(value) for name, value in held.items()}


def _text(told: dict[str, Any], key: str) -> str:
    value = told.get(key)
    if not isinstance(value, str) or not value:
        raise ValueError(f"{key}: {value!r} is not a name")
    return value


def _numbers(told: dict[str, Any], key: str, number: int) -> FloatArray:
    values = told[key]
    if not isinstance(values, list) or len(values) != number or not all(_is_number(value) for value in values):
        raise ValueError(f"{key}: {values!r} is not a list of {number} finite numbers")
    return np.array(values, dtype=np.float64)


def _positive(told: dict[str, Any], key: str) -> FloatArray:
    values = _numbers(told, key, N_ARM_JOINTS)
    if not (values > 0).all():
        raise ValueError(f"{key}: {told[key]!r} are not all above 0")
    return values


def _unit(told: dict[str, Any], key: str) -> FloatArray:
    vector = _numbers(told, key, 3)
    length = float(np.linalg.norm(vector))
    if not length > 0:
        raise ValueError(f"{key}: {told[key]!r} has no direction")
    return vector / length


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= sys.float_info.max


def nasa_mapping() -> RobotMapping:
    """Return the mapping of NASA's own descriptions of Robonaut 2."""
    return replace(
        shell_mapping(),
        held={**shell_mapping().held, **_neck(_NASA_NECK_POSTURE)},
        shoulders=SHOULDERS + _NASA_PLACE,
        eye=_FOREHEAD,
    )


def shell_mapping() -> RobotMapping:
    """Return the mapping of the shell, which has the joint names of NASA's Robonaut 2."""
    joints = arm("left")
    return RobotMapping(
        arms=(arm_joint_names("left"), arm_joint_names("right")),
        forward=np.array([mirrored(ARM_AXIS, side) for side in SIDES]),
        palm=np.array([[0.0, 0.0, -1.0]] * 2),
        name="NASA's Robonaut 2",
        waist=WAIST.name,
        held={**_neck(_NECK_POSTURE), **dict.fromkeys(_FINGERS, 1.5)},
        velocity=np.array([joint.velocity for joint in joints]),
        effort=np.array([joint.effort for joint in joints]),
        rotor_inertia=np.array([joint.rotor_inertia for joint in joints]),
    )


def _neck(posture: tuple[float, ...]) -> dict[str, float]:
    return {joint.name: angle for joint, angle in zip(NECK, posture, strict=True)}
