"""Files of every version that was ever written still load: one small file each in tests/data/formats."""

import shutil
from pathlib import Path

import pytest

from atg_fg.core.patterns import Evidence
from atg_fg.experiments.ablation import AblationLog, Cell
from atg_fg.experiments.goals import GoalRunFile
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage import memory_files, memory_json
from atg_fg.storage.database.copying import records_in_log
from atg_fg.storage.memory_files import open_memory
from atg_fg.storage.presets import preset
from atg_fg.storage.scripted_trial import read_script
from atg_fg.storage.trial_log import read_log, to_line

FORMATS = Path(__file__).parent / "data" / "formats"


def test_memory_1() -> None:
    memory = memory_files.load_memory(FORMATS / "memory-1.json")
    assert memory.names == ("object-000", "object-001")
    assert memory_json.memory_to_json(memory) == (FORMATS / "memory-1.json").read_text()


def test_memory_1_with_structure_and_merges() -> None:
    memory = memory_files.load_memory(FORMATS / "memory-1-structured.json")
    assert isinstance(memory, StructuredMemory)
    assert (memory.names, len(memory.learner.trials)) == (("object-000",), 2)
    assert [merge.dropped.name for merge in memory.merges] == ["object-001"]
    assert memory_json.memory_to_json(memory) == (FORMATS / "memory-1-structured.json").read_text()


def test_memory_1_with_classes_of_appearance() -> None:
    memory = memory_files.load_memory(FORMATS / "memory-1-sense.json")
    assert memory.sense is not None
    assert (memory.sense.features, len(memory.sense.trials)) == ("two", 3)
    assert memory_json.memory_to_json(memory) == (FORMATS / "memory-1-sense.json").read_text()


def test_memory_1_with_labels() -> None:
    memory = memory_files.load_memory(FORMATS / "memory-1-labels.json")
    alphabet = memory.assumptions.alphabet
    assert (alphabet.is_open, alphabet.names[0]) == (True, "logo")
    assert memory_json.memory_to_json(memory) == (FORMATS / "memory-1-labels.json").read_text()


def test_memory_1_with_evidence() -> None:
    memory = memory_files.load_memory(FORMATS / "memory-1-evidence.json")
    assert isinstance(memory, StructuredMemory)
    saved = memory.evidence.saved()
    assert saved is not None
    assert (saved.n_trials, len(memory.learner.trials)) == (3, 3)


@pytest.mark.parametrize("name", [path.name for path in sorted(FORMATS.glob("memory-*"))])
def test_every_memory_goes_into_a_database_and_back(name: str, tmp_path: Path) -> None:
    memory = memory_files.load_memory(FORMATS / name)
    memory_files.save_memory(memory, tmp_path / "robot.db")
    memory_files.save_memory(memory_files.load_memory(tmp_path / "robot.db"), tmp_path / "memory.json")
    assert memory_files.load_memory(tmp_path / "memory.json") == memory


def test_database_schema_1(tmp_path: Path) -> None:
    with open_memory(shutil.copy(FORMATS / "memory-schema-1.db", tmp_path)) as memory:
        assert memory.names == ("object-000", "object-001")
        assert [(each.kind, each.seed) for each in memory.experiments()] == [("trial", 0)]
        assert [trial.learned for trial in memory.trials()] == ["object-000", "object-001"]


def test_test_1() -> None:
    assert [line["verdict"] for line in read_log(FORMATS / "test-1.jsonl.gz")[1]] == ["novel", "novel"]
    experiment, trials = records_in_log(FORMATS / "test-1.jsonl.gz")
    assert (experiment.seed, experiment.parameters) == (3, {"world": "ideal"})
    assert [to_line(trial) for trial in trials] == read_log(FORMATS / "test-1.jsonl.gz")[1]


def test_goal_run_1() -> None:
    (first, *_) = GoalRunFile(FORMATS / "goal-run-1.json.gz", {"seed": 0, "run": 0}).read()
    assert first.goal is not None


def test_preset_1() -> None:
    assert preset(str(FORMATS / "preset-1.json")).observation_noise == 0.0005


def test_ablation_1(tmp_path: Path) -> None:
    log = AblationLog(Path(shutil.copy(FORMATS / "ablation-1.jsonl", tmp_path)), n_trials=5)
    result = log.get(Cell("default", "ideal", "ideal", 4), 0)
    assert result is not None
    assert result.success == (4, 5)


def test_scripted_trial_1() -> None:
    file = FORMATS.parent / "scripted_trial.json"
    assert len(read_script(file.read_text()).steps) == 3


def test_scripted_trial_2() -> None:
    script = read_script((FORMATS / "scripted-trial-2.json").read_text())
    assert not script.memory.assumptions.alphabet.exclusive
    look = script.steps[0]
    assert isinstance(look, Evidence)
    assert look.slots == ((0.0, 0.8, 0.2), None)
    assert look.confidences == (None, 0.75)
