"""What `atg-fg doctor` checks of the simulator: an image is rendered and read, and the robot moves."""

from __future__ import annotations

import numpy as np


def rendering_and_detection() -> str:
    """Render one cube with the camera and read its tags; the truth is known."""
    from atg_fg.worlds.base import detection_of
    from atg_fg.worlds.registry import make_world

    world = make_world("rendered")
    observation, info = world.reset(seed=0, options={"object": 0, "orientation": 0})
    seen, shown = detection_of(observation), tuple(info["pattern"])
    world.close()
    if seen != shown:
        raise ArithmeticError(f"the camera saw {seen}; the cube shows {shown}")
    return f"tags {shown[0]} and {shown[1]} read from a rendered image"


def robot() -> str:
    """Let the robot flip a cube; the truth is known."""
    from atg_fg.worlds.registry import make_world

    world = make_world("robonaut")
    world.reset(seed=0, options={"object": 0})
    _, _, _, _, info = world.step(np.int64(0))
    world.close()
    if info["lost"] or info["orientation"] != info["expected_orientation"]:
        raise ArithmeticError("the cube was not turned as it should")
    return "the robot turned a cube over"
