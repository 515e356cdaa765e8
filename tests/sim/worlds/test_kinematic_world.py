"""Worlds of objects that are turned without a robot: what holds of boxes with pictures and of things of odd shapes."""

from contextlib import closing

import pytest

from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.worlds.registry import make_world_with

WORLDS = ("picture-box", "meshes")


@pytest.mark.parametrize(("name", "n_objects", "weight"), [("picture-box", 12, False), ("meshes", 4, True)])
def test_observations_are_of_the_space_and_each_look_is_rendered_anew(name, n_objects, weight):
    with closing(make_world_with(name, n_objects, 3, weight=weight)) as world:
        first, _ = world.reset(seed=1, options={"object": 2, "orientation": 5})
        again, _ = world.reset(seed=1, options={"object": 2, "orientation": 5})
        other, info = world.reset(seed=2, options={"object": 2, "orientation": 5})
        assert world.observation_space.contains(first)
    assert (first["appearance"] == again["appearance"]).all()
    assert (first["appearance"] != other["appearance"]).any()
    assert (info["object"], info["orientation"]) == (2, 5)


@pytest.mark.parametrize(
    ("name", "options", "message"),
    [
        ("picture-box", {"weight": "yes"}, "weight: 'yes'; expected true or false"),
        ("picture-box", {"differ_in": "smell"}, "differ_in: 'smell'; expected one of: face, weight"),
        ("picture-box", {"weight_error": -0.1, "weight": True}, "object sense 'weight': error -0.1"),
        ("picture-box", {"features": "no_such_module:embed"}, "features 'no_such_module:embed': cannot be imported"),
        (
            "picture-box",
            {"features": "sift"},
            "expected 'colours-and-gradients', 'grid-and-gradients' or module:function",
        ),
        ("picture-box", {"look_alikes": 2.0}, "look_alikes: 2.0; expected a probability"),
        ("picture-box", {"image_noise": -1.0}, "image_noise: -1.0; expected a finite number"),
        ("picture-box", {"n_objects": 0}, "n_objects: 0"),
        (
            "meshes",
            {"features": "colours-and-gradients"},
            r"crop: shape \(96, 96, 3\).*; expected RGB bytes, 48 by 48 pixels",
        ),
        ("meshes", {"weight": 1}, "weight: 1; expected true or false"),
        ("meshes", {"weight_error": 0.0, "weight": True}, "object sense 'weight': error 0.0"),
        ("meshes", {"n_objects": 901}, "n_objects: 901; expected a whole number from 1 to 900"),
        ("meshes", {"image_noise": float("nan")}, "image_noise: nan"),
    ],
)
def test_options_of_nonsense_are_refused(name, options, message):
    with pytest.raises(InvalidInputError, match=message):
        make_world_with(name, options.pop("n_objects", 3), 0, **options)


@pytest.mark.parametrize("name", WORLDS)
def test_an_option_that_there_is_not_is_refused(name):
    with pytest.raises(InvalidInputError, match=f"world '{name}': option 'magic': unknown; expected"):
        make_world_with(name, 3, 0, magic=1)


@pytest.mark.parametrize("name", WORLDS)
def test_an_unknown_render_mode_is_refused(name):
    with pytest.raises(UnknownNameError, match="human"):
        make_world_with(name, 3, 0, render_mode="human")
