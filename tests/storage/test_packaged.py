"""What comes with the package is what it says."""

import json
from pathlib import Path

import pytest

from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage import packaged
from atg_fg.storage.memory_json import memory_from_json

RESULTS = Path(__file__).parents[2] / "results"


def test_the_example_is_a_sound_memory_that_has_learned_what_cubes_share():
    memory = memory_from_json(packaged.example_memory(), "example")
    assert isinstance(memory, StructuredMemory)
    assert len(memory) == 25
    assert len(memory.learner.trials) == 30


def test_a_result_is_found_in_a_checkout_and_beside_the_data_of_a_wheel(tmp_path, monkeypatch):
    assert packaged.packaged_result("ablation") == json.loads((RESULTS / "ablation.json").read_text())
    (tmp_path / "results").mkdir()
    (tmp_path / "results" / "ablation.json").write_text('{"cells": []}')
    monkeypatch.setattr(packaged, "_DATA", tmp_path)
    assert packaged.packaged_result("ablation") == {"cells": []}
    with pytest.raises(FileNotFoundError):
        packaged.packaged_result("nowhere")
