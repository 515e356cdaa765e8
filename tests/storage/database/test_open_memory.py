import copy
import json
import pickle
import sqlite3
from concurrent.futures import ThreadPoolExecutor

import pytest

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.errors import BusyMemoryError, InvalidInputError, UnknownNameError
from atg_fg.core.parameters import ModelParameters
from atg_fg.experiments.trial import learn_from
from atg_fg.learning.structured_memory import StructuredMemory, memory_for
from atg_fg.storage import memory_files, memory_json
from atg_fg.storage.database.checking import faults_of_database
from atg_fg.storage.memory_files import open_memory
from tests.small import one_slot
from tests.storage.database.small import ARCUBES, a_record, add_cube, plain, structured


@pytest.fixture
def path(tmp_path):
    return tmp_path / "robot.db"


def test_what_is_learned_is_in_the_file_at_once(path):
    with open_memory(path, ARCUBES) as memory:
        for number in range(3):
            name = add_cube(memory, number)
            assert memory_files.load_memory(path) == memory
        add_cube(memory, 4, matched=name)
        assert memory_files.load_memory(path) == memory
    assert [each.name for each in path.parent.iterdir()] == ["robot.db"]
    with open_memory(path) as again:
        assert again == memory


def test_a_memory_that_learns_structure_keeps_all_of_it(path):
    with memory_for(ModelParameters(learn_structure=True), open_memory(path, ARCUBES)) as memory:
        for number in range(3):
            add_cube(memory, number)
    loaded = memory_files.load_memory(path)
    assert isinstance(loaded, StructuredMemory)
    assert loaded == memory
    with open_memory(path) as again:  # opened anew it goes on as the one that was never closed
        add_cube(again, 3)
    memory = memory.copy()
    add_cube(memory, 3)
    assert memory_files.load_memory(path) == memory


@pytest.mark.parametrize("make", [plain, structured])
def test_merges_are_kept_and_undone(path, make):
    memory_files.save_memory(make(), path)
    with open_memory(path) as memory:
        before = memory_json.memory_to_json(memory)
        memory.merge("object-000", "object-001")
        assert memory_files.load_memory(path) == memory
        memory.merge("object-002", "object-000")
        assert memory_files.load_memory(path) == memory
        memory.unmerge("object-000")
        memory.unmerge("object-001")
        assert memory_json.memory_to_json(memory) == before
    assert memory_json.memory_to_json(memory_files.load_memory(path)) == before
    assert faults_of_database(path) == []


def test_json_and_a_database_say_the_same(tmp_path):
    memory = structured()
    memory.merge("object-000", "object-002")
    memory_files.save_memory(memory, tmp_path / "memory.json")
    memory_files.save_memory(memory_files.load_memory(tmp_path / "memory.json"), tmp_path / "robot.db")
    assert (
        memory_json.memory_to_json(memory_files.load_memory(tmp_path / "robot.db"))
        == (tmp_path / "memory.json").read_text()
    )


def test_a_file_is_what_its_content_says(tmp_path):
    memory = plain()
    memory_files.save_memory(memory, tmp_path / "robot.db")
    (tmp_path / "robot.db").rename(tmp_path / "memory.json")
    assert memory_files.load_memory(tmp_path / "memory.json") == memory
    memory_files.save_memory(plain(1), tmp_path / "memory.json")  # and stays so
    assert (tmp_path / "memory.json").read_bytes().startswith(b"SQLite format 3")
    (tmp_path / "text.db").write_text(memory_json.memory_to_json(memory))
    assert memory_files.load_memory(tmp_path / "text.db") == memory


def learn_and_fail(memory):
    with memory.transaction():
        add_cube(memory, 3)
        memory.merge("object-000", "cup")


def test_an_error_inside_a_transaction_leaves_memory_and_file_as_they_were(path):
    memory_files.save_memory(structured(2), path)
    with open_memory(path) as memory:
        before = memory_json.memory_to_json(memory)
        with pytest.raises(UnknownNameError):
            learn_and_fail(memory)
        assert memory_json.memory_to_json(memory) == before
        assert memory_json.memory_to_json(memory_files.load_memory(path)) == before
        add_cube(memory, 3)
        assert memory_files.load_memory(path) == memory


def test_readers_see_the_old_memory_until_the_trial_is_whole(path):
    memory_files.save_memory(plain(1), path)
    with open_memory(path) as writer, open_memory(path, read_only=True) as reader:
        with writer.transaction():
            add_cube(writer, 1)
            reader.refresh()
            assert reader.names == memory_files.load_memory(path).names == ("object-000",)
        assert reader.names == ("object-000",)
        reader.refresh()
        assert reader == writer
        with pytest.raises(InvalidInputError, match="opened to be read only"):
            add_cube(reader, 2)


def test_a_second_writer_is_told_to_wait(path):
    memory_files.save_memory(plain(1), path)
    with open_memory(path) as first, open_memory(path, wait=0.01) as second:
        with first.transaction():
            add_cube(first, 1)
            with pytest.raises(BusyMemoryError, match="another process is writing"):
                add_cube(second, 2)
            assert second.names == ("object-000",)
        add_cube(second, 2)
        assert memory_files.load_memory(path) == second
        assert second.names == ("object-000", "object-001", "object-002")


def test_writers_by_turns_lose_nothing_of_each_other(path):
    alone = plain(4)
    with open_memory(path, ARCUBES) as first, open_memory(path) as second:
        for number in range(4):
            add_cube(second if number % 2 else first, number)
    assert memory_files.load_memory(path) == alone


def test_a_writer_that_knows_no_structure_does_not_write_over_it(path):
    memory_files.save_memory(plain(1), path)
    with open_memory(path) as old:
        with memory_for(ModelParameters(learn_structure=True), open_memory(path)) as other:
            add_cube(other, 1)
        with pytest.raises(InvalidInputError, match="begun to learn structure"):
            add_cube(old, 2)
    assert memory_files.load_memory(path) == other


def test_the_records_of_trials_can_be_read_back(path):
    records = [a_record(seed, missing=0.2) for seed in range(3)]
    with open_memory(path, ARCUBES) as memory:
        learn_from(records[0], memory)
        memory.begin_experiment("trial", {"engine": "bayes-filter", "actions": 4}, seed=2**70)
        learned = [learn_from(record, memory) for record in records[1:]]
        (experiment,) = memory.experiments()
        assert (experiment.kind, experiment.seed, experiment.parameters["actions"]) == ("trial", 2**70, 4)
        assert [trial.experiment for trial in memory.trials()] == [None, 1, 1]
        trials = list(memory.trials(experiment.number))
    assert [trial.learned for trial in trials] == learned
    for number, (trial, record) in enumerate(zip(trials, records[1:], strict=True)):
        assert (trial.number, trial.verdict, trial.matched) == (number, record.verdict, record.matched)
        for stored, step in zip(trial.steps, record.steps, strict=True):
            assert (stored.observed, stored.pattern) == (step.detection, step.pattern)
            assert stored.truth == json.loads(json.dumps(step.truth))
            assert (stored.unseen, stored.entropy) == (step.belief.unseen, step.belief.entropy)
            assert stored.log_evidence == step.log_evidence
            expected = step.expected_entropies
            assert stored.expected_entropy == (
                None if expected is None else dict(zip(ARCUBES.actions, expected.tolist(), strict=True))
            )
            assert stored.action == (None if step.action is None else ARCUBES.actions[step.action])
    assert faults_of_database(path) == []


def test_a_record_and_what_was_learned_are_one_transaction(path, monkeypatch):
    def out_of_order(*_):
        raise InvalidInputError("no")

    with open_memory(path, ARCUBES) as memory:
        memory.begin_experiment("trial", {}, seed=0)
        with monkeypatch.context() as patch:
            patch.setattr("atg_fg.storage.database.trial_rows.add_trial", out_of_order)
            with pytest.raises(InvalidInputError, match="no"):
                learn_from(a_record(0), memory)
        assert (len(memory), list(memory.trials()), list(memory.experiments())) == (0, [], [])
        learn_from(a_record(0), memory)
        assert (len(memory), len(list(memory.trials())), len(list(memory.experiments()))) == (1, 1, 1)


def test_more_trials_are_read_than_fit_a_page(path, monkeypatch):
    monkeypatch.setattr("atg_fg.storage.database.trial_rows._PAGE", 2)
    record = a_record(0)
    with open_memory(path, ARCUBES) as memory:
        for _ in range(5):
            memory.add_record(record, None)
        assert [trial.number for trial in memory.trials()] == [0, 1, 2, 3, 4]


def test_a_memory_in_no_file_has_no_records(path):
    memory = plain(1)
    learn_from(a_record(0), memory)
    assert (list(memory.trials()), list(memory.experiments()), memory.is_kept) == ([], [], False)


def test_saving_over_a_database_replaces_the_memory_and_keeps_the_records(path):
    with open_memory(path, ARCUBES) as memory:
        for seed in range(3):
            learn_from(a_record(seed), memory)
    memory_files.save_memory(plain(1), path)
    with open_memory(path, read_only=True) as memory:
        assert memory == plain(1)
        # Of the trials only what went to an ATG that is still there counts as learned.
        assert [trial.learned for trial in memory.trials()] == ["object-000", None, None]
    assert faults_of_database(path) == []


def test_a_file_that_is_no_memory_is_refused_and_left_alone(tmp_path):
    other = tmp_path / "other.db"
    connection = sqlite3.connect(other)
    connection.execute("CREATE TABLE things (name TEXT)")
    connection.commit()
    connection.close()
    before = other.read_bytes()
    for use in (memory_files.load_memory, open_memory, lambda path: memory_files.save_memory(plain(1), path)):
        with pytest.raises(InvalidInputError, match="expected a memory of atg-fg"):
            use(other)
    assert other.read_bytes() == before
    with pytest.raises(InvalidInputError, match="cannot be read: No such file"):
        open_memory(tmp_path / "absent.db")
    assert not (tmp_path / "absent.db").exists()
    (tmp_path / "text").write_text("hello")
    with pytest.raises(InvalidInputError, match="not an SQLite file"):
        open_memory(tmp_path / "text", ARCUBES)


def test_other_assumptions_are_refused(path):
    memory_files.save_memory(plain(1), path)
    with pytest.raises(InvalidInputError, match="under other assumptions"):
        open_memory(path, one_slot(3, 3, 6))


def test_what_sqlite_cannot_hold_is_refused_and_nothing_is_written(path):
    memory = plain(1)
    graph = AspectTransitionGraph("half a character", memory.assumptions)
    graph.name += ": \ud800"
    memory.add(graph)
    with pytest.raises(InvalidInputError, match="cannot be held in a database"):
        memory_files.save_memory(memory, path)
    with pytest.raises(InvalidInputError, match="holds no memory"):
        memory_files.load_memory(path)


def test_a_memory_that_another_thread_uses_is_refused_by_that_name(path):
    with open_memory(path, ARCUBES) as memory:
        add_cube(memory, 0)
        with ThreadPoolExecutor(1) as pool:
            for use in (lambda: add_cube(memory, 1), memory.refresh, lambda: list(memory.trials())):
                with pytest.raises(InvalidInputError, match="used from another thread than the one that opened it"):
                    pool.submit(use).result()
        add_cube(memory, 1)
        assert memory_files.load_memory(path) == memory


def test_a_copy_of_a_memory_is_in_no_file(path):
    with open_memory(path, ARCUBES) as memory:
        add_cube(memory, 0)
        for copied in (copy.deepcopy(memory), pickle.loads(pickle.dumps(memory))):
            assert copied == memory
            assert not copied.is_kept
            add_cube(copied, 1)
        assert len(memory_files.load_memory(path)) == len(memory) == 1
