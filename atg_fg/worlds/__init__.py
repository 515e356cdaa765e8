"""What the robot acts on: gymnasium environments and their registry.

Importing this package registers its worlds with gymnasium; the module of a world is imported when one is made.
"""

import gymnasium

gymnasium.register(id="atg_fg/ARcube-v0", entry_point="atg_fg.worlds.arcube_world:ARcubeWorld")
gymnasium.register(id="atg_fg/Detector-v0", entry_point="atg_fg.worlds.detector_world:DetectorWorld")
gymnasium.register(
    id="atg_fg/ActiveClassification-v0",
    entry_point="atg_fg.worlds.active_classification:ActiveClassificationWorld",
    max_episode_steps=10,
)

for _id, _family in {
    "HexagonalPrism": "prism",
    "RingLock": "lock",
    "LidBox": "lid-box",
    "RandomATG": "random-atg",
    "HalfAndHalf": "half-and-half",
    "MixedKinds": "mixed",
    "RepeatedTags": "repeated-tags",
}.items():
    gymnasium.register(
        id=f"atg_fg/{_id}-v0", entry_point="atg_fg.worlds.object_world:make_object_world", kwargs={"family": _family}
    )
