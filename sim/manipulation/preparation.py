"""A user's description made ready: read here, but first loaded in a process of its own, which a bad file may take down.

PyBullet does not survive all files: mesh indices beyond the mesh crash it, others take for ever, and what it has to say
it prints on standard output. So a process of its own, with a time limit, loads the robot, finds where its hands touch,
what overlaps, and which postures to work from; it writes what it found into a file.
"""

from __future__ import annotations

import logging
import os
import signal
import subprocess
import sys
import tempfile
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

import numpy as np
import pybullet

from atg_fg.core.errors import InvalidInputError
from sim.bodies.contact_pads import contact_pad
from sim.bodies.prepared_robot import PreparedRobot, assembled, kinematics_of
from sim.bodies.robot import RobotBody
from sim.bodies.robot_mapping import nasa_mapping, read_mapping
from sim.bodies.robot_model import RobotModel, fitted
from sim.bodies.tables import table_top
from sim.bodies.urdf_reader import read_urdf
from sim.manipulation.postures import PostureSearch

_LOG: Final = logging.getLogger(__name__)
#: Reading meshes and trying postures takes 10 s on a slow machine.
_TIME_LIMIT: Final = 120.0  # s
_MEMORY_LIMIT: Final = 4 << 30  # bytes
_FOUND: Final = ("pads", "pad_radius", "home", "tucked", "overlapping")


def prepared(urdf: Path) -> PreparedRobot:
    """Return a user's robot, ready to be loaded.

    Raises:
        InvalidInputError: The file is no robot's description, lacks a joint, or cannot be loaded.
    """
    try:
        stamp = urdf.stat().st_mtime_ns
    except OSError:
        stamp = 0
    return _prepared(urdf.absolute(), stamp)


@lru_cache(maxsize=4)
def _prepared(urdf: Path, _stamp: int) -> PreparedRobot:
    model = _model(urdf)
    for note in model.notes:
        _LOG.warning("note: %s", note)
    with tempfile.TemporaryDirectory(prefix="robot-") as folder:
        found_file = Path(folder) / "found.npz"
        _run_examination(urdf, found_file)
        with np.load(found_file) as found:
            pads, pad_radius, home, tucked, overlapping = (found[name] for name in _FOUND)
    kinematics = kinematics_of(model, pads, pad_radius)
    pairs = tuple((str(one), str(other)) for one, other in overlapping)
    return assembled(model, kinematics, home, tucked, pairs)


def _model(path: Path) -> RobotModel:
    urdf, mapping = read_mapping(path) if path.suffix == ".toml" else (path, nasa_mapping())
    return fitted(read_urdf(urdf), mapping)


def _run_examination(urdf: Path, found: Path) -> None:
    """Examine a robot in a process of its own."""
    command = [sys.executable, "-m", "sim.manipulation.preparation", str(urdf), str(found)]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    try:
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, timeout=_TIME_LIMIT, env=environment, check=False
        )
    except subprocess.TimeoutExpired:
        problem = f"not in {_TIME_LIMIT:.0f} s"
    else:
        if done.returncode == 0:
            return
        lines = [line for line in done.stderr.decode(errors="replace").splitlines() if line.strip()]
        crashed = done.returncode < 0
        problem = f"PyBullet crashed ({signal.Signals(-done.returncode).name})" if crashed else lines[-1]
    raise InvalidInputError(f"{urdf}: cannot be loaded: {problem}; expected a robot's description with its meshes")


def examine(model: RobotModel) -> dict[str, Any]:
    """Load a robot and find out what its plans need to know of it, by the names of ``_FOUND``."""
    client = pybullet.connect(pybullet.DIRECT)
    try:
        wrists = np.array([model.joints[arm[-1]].position for arm in model.mapping.arms])
        bare = kinematics_of(model, wrists, np.zeros(2))
        zero = np.zeros_like(bare.lower)
        body = RobotBody(client, assembled(model, bare, zero, zero))
        pads = [
            contact_pad(client, body.body, hand, wrist, forward)
            for hand, wrist, forward in zip(body.hands, wrists, model.mapping.forward, strict=True)
        ]
        middles, radii = np.array([pad for pad, _ in pads]), np.array([radius for _, radius in pads])
        search = PostureSearch(body, kinematics_of(model, middles, radii), [table_top(client)])
        overlapping = search.overlapping()
        body.let_touch(overlapping)
        home = search.home()
        found = (middles, radii, home, search.tucked(home), np.array(overlapping, dtype=str).reshape(-1, 2))
        return dict(zip(_FOUND, found, strict=True))
    finally:
        pybullet.disconnect(physicsClientId=client)


def _main(urdf: str, found: str) -> None:
    try:
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (_MEMORY_LIMIT, _MEMORY_LIMIT))
    except (ImportError, ValueError, OSError):
        pass  # Not all systems know such limits; the time limit holds everywhere.
    np.savez(found, **examine(_model(Path(urdf))))


if __name__ == "__main__":
    _main(*sys.argv[1:])
