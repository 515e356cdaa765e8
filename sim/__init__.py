"""The ARcube in simulation: a robot turns it in PyBullet, OpenCV ArUco detection supplies the evidence.

Importing this package registers its worlds with gymnasium; PyBullet and OpenCV are imported when one is made.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import sys
from typing import Any

import gymnasium

from atg_fg.errors import MissingDependencyError

_REQUIRED = {"pybullet": "pybullet", "cv2": "opencv-python-headless"}


def require_simulator() -> None:
    """Raise ``MissingDependencyError`` if PyBullet or OpenCV is not installed."""
    for module, distribution in _REQUIRED.items():
        if importlib.util.find_spec(module) is None:
            raise MissingDependencyError(
                f"simulated worlds: the package {distribution} is not installed; expected the extra 'sim': "
                'pip install "atg-fg[sim]" on Python 3.11, the last version that PyBullet has wheels for'
            )


def make_rendered_arcube(**options: Any) -> gymnasium.Env[Any, Any]:
    """Return a ``sim.rendered.RenderedARcubeWorld``; its module is imported only now."""
    require_simulator()
    import_quietly("pybullet")
    from sim.rendered import RenderedARcubeWorld

    return RenderedARcubeWorld(**options)


def make_robonaut_arcube(**options: Any) -> gymnasium.Env[Any, Any]:
    """Return a ``sim.robot.world.RobonautARcubeWorld``; its module is imported only now."""
    from sim.robot.world import RobonautARcubeWorld

    return RobonautARcubeWorld(**options)


def make_robonaut_table(**options: Any) -> gymnasium.Env[Any, Any]:
    """Return a ``sim.robot.table_world.RobonautTableWorld``; its module is imported only now."""
    from sim.robot.table_world import RobonautTableWorld

    return RobonautTableWorld(**options)


def import_quietly(module: str) -> None:
    """Import a module that prints a banner from C on standard error, without the banner.

    What comes there from this project is a fault, in one line.
    """
    if module in sys.modules:
        return
    sys.stderr.flush()
    standard_error, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        importlib.import_module(module)
    finally:
        os.dup2(standard_error, 2)
        os.close(standard_error)
        os.close(nowhere)


gymnasium.register(id="sim/RenderedARcube-v0", entry_point="sim:make_rendered_arcube")
gymnasium.register(id="sim/RobonautARcube-v0", entry_point="sim:make_robonaut_arcube")
gymnasium.register(id="sim/RobonautTable-v0", entry_point="sim:make_robonaut_table")
