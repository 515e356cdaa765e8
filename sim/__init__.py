"""The ARcube in simulation: a robot turns it in PyBullet, OpenCV ArUco detection supplies the evidence.

Importing this package registers its worlds with gymnasium; PyBullet and OpenCV are imported when one is made.
"""

from __future__ import annotations

from typing import Any

import gymnasium

from sim.simulator import import_quietly, require_simulator


def make_rendered_arcube(**options: Any) -> gymnasium.Env[Any, Any]:
    """Return a ``sim.worlds.rendered_world.RenderedARcubeWorld``; its module is imported only now."""
    require_simulator()
    import_quietly("pybullet")
    from sim.worlds.rendered_world import RenderedARcubeWorld

    return RenderedARcubeWorld(**options)


def make_picture_box(**options: Any) -> gymnasium.Env[Any, Any]:
    """Return a ``sim.worlds.picture_box_world.PictureBoxWorld``; its module is imported only now."""
    require_simulator()
    import_quietly("pybullet")
    from sim.worlds.picture_box_world import PictureBoxWorld

    return PictureBoxWorld(**options)


def make_meshes(**options: Any) -> gymnasium.Env[Any, Any]:
    """Return a ``sim.worlds.meshes_world.MeshesWorld``; its module is imported only now."""
    require_simulator()
    import_quietly("pybullet")
    from sim.worlds.meshes_world import MeshesWorld

    return MeshesWorld(**options)


def make_robonaut_arcube(**options: Any) -> gymnasium.Env[Any, Any]:
    """Return a ``sim.worlds.robonaut_arcube_world.RobonautARcubeWorld``; its module is imported only now."""
    from sim.worlds.robonaut_arcube_world import RobonautARcubeWorld

    return RobonautARcubeWorld(**options)


def make_robonaut_picture_box(**options: Any) -> gymnasium.Env[Any, Any]:
    """Return a ``sim.worlds.robonaut_picture_box_world.RobonautPictureBoxWorld``; its module is imported only now."""
    from sim.worlds.robonaut_picture_box_world import RobonautPictureBoxWorld

    return RobonautPictureBoxWorld(**options)


def make_robonaut_table(**options: Any) -> gymnasium.Env[Any, Any]:
    """Return a ``sim.worlds.stations_world.RobonautTableWorld``; its module is imported only now."""
    from sim.worlds.stations_world import RobonautTableWorld

    return RobonautTableWorld(**options)


gymnasium.register(id="sim/RenderedARcube-v0", entry_point="sim:make_rendered_arcube")


gymnasium.register(id="sim/PictureBox-v0", entry_point="sim:make_picture_box")


gymnasium.register(id="sim/Meshes-v0", entry_point="sim:make_meshes")


gymnasium.register(id="sim/RobonautARcube-v0", entry_point="sim:make_robonaut_arcube")


gymnasium.register(id="sim/RobonautPictureBox-v0", entry_point="sim:make_robonaut_picture_box")


gymnasium.register(id="sim/RobonautTable-v0", entry_point="sim:make_robonaut_table")
