import json

import pytest

from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.core.parameters import ModelParameters
from atg_fg.storage.presets import PRESETS, preset, read_preset, write_preset

MEASURED = ModelParameters(0.02, 0.001)


def test_presets_are_those_of_the_model_page():
    assert preset("paper") == ModelParameters(1e-8, 1e-8, learn_in_trial=False)
    assert preset("default") == ModelParameters(1e-8, 1e-8, learn_in_trial=True)
    assert preset("learned") == ModelParameters(1e-8, 1e-8, learn_in_trial=True, learn_structure=True)
    assert ModelParameters() == PRESETS["default"]


def test_the_robot_preset_assumes_more_noise_than_none():
    assert preset("robot").learn_in_trial
    assert 1e-4 < preset("robot").transition_concentration < 1
    assert 1e-6 < preset("robot").observation_noise < 0.1


def test_an_unknown_preset_is_refused_with_the_names_there_are():
    with pytest.raises(UnknownNameError, match="default, learned, paper, robot"):
        preset("Paper")


def test_a_preset_of_ones_own_is_a_file(tmp_path):
    file = tmp_path / "mine.json"
    file.write_text(json.dumps(write_preset(MEASURED, command="measure it")))
    assert preset(str(file)) == MEASURED
    assert "learn_structure" not in file.read_text()
    file.write_text(json.dumps(write_preset(PRESETS["learned"])))
    assert preset(str(file)) == PRESETS["learned"]


def test_a_file_that_is_not_there_is_refused_by_name():
    with pytest.raises(InvalidInputError, match=r"nowhere\.json: cannot be read"):
        preset("nowhere.json")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": "atg-fg/memory"}, "mine: format"),
        ({"version": 2}, "mine: version"),
        ({"parameters": {"observation_noise": 0.1}}, "mine: parameters"),
        ({"parameters": {**write_preset(MEASURED)["parameters"], "observation_noise": 2}}, "observation_noise: 2"),
        ({"parameters": None}, "mine: parameters"),
    ],
    ids=["format", "version", "missing", "range", "none"],
)
def test_a_preset_that_is_none_is_refused(change, message):
    with pytest.raises(InvalidInputError, match=message):
        read_preset(json.dumps({**write_preset(MEASURED), **change}), "mine")


@pytest.mark.parametrize("text", ["[]", "{}", "nonsense", "3"])
def test_other_documents_are_refused(text):
    with pytest.raises(InvalidInputError, match="mine"):
        read_preset(text, "mine")
