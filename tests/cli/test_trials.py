import json
import subprocess
import sys
from pathlib import Path

import pytest

from atg_fg.storage import memory_files
from tests.experiments.test_replay import SCRIPT

COMMAND = Path(sys.executable).with_name("atg-fg")


@pytest.fixture
def script(tmp_path):
    path = tmp_path / "script.json"
    path.write_text(json.dumps(SCRIPT))
    return path


def test_replay_prints_one_line_of_json_a_file(run, script):
    status, output, error = run("replay", script, script, "--engine", "bayes-filter")
    assert (status, error) == (0, "")
    lines = output.splitlines()
    assert len(lines) == 2
    assert lines[0] == lines[1]
    assert json.loads(lines[0])["engine"] == "bayes-filter"


def test_the_installed_command_replays_and_refuses(script, tmp_path):
    done = subprocess.run([COMMAND, "replay", script, "--smooth"], capture_output=True, text=True, check=True)
    document = json.loads(done.stdout)
    assert (document["engine"], document["smoothed"]["object"]) == ("gtsam", "cube-000")
    (tmp_path / "bad.json").write_text("{")
    bad = subprocess.run(
        [COMMAND, "replay", script, tmp_path / "bad.json"], capture_output=True, text=True, check=False
    )
    assert (bad.returncode, bad.stdout) == (2, "")
    assert bad.stderr.count("\n") == 1
    assert "bad.json: not valid JSON" in bad.stderr


def test_replay_has_a_table_for_people(run, script):
    status, output, _ = run("replay", script, "--table")
    assert status == 0
    assert "cube-000" in output


def test_every_file_is_checked_before_the_first_is_run(refused, script, tmp_path):
    assert "absent.json: cannot be read" in refused("replay", script, tmp_path / "absent.json")


def test_evidence_of_probability_zero_leaves_no_half_answer(refused, script, tmp_path):
    certain = {"transition_concentration": 0, "observation_noise": 0, "learn_in_trial": True}
    looks = [{"observe": pattern} for pattern in ([0, 1], [2, 3], [0, 1], [4, 5])]
    steps = [step for look in looks for step in (look, {"act": "flip"})]
    (tmp_path / "odd.json").write_text(json.dumps({**SCRIPT, "parameters": certain, "steps": steps}))
    assert "odd.json: steps[6]: the evidence has probability zero" in refused("replay", script, tmp_path / "odd.json")


def test_an_engine_that_would_need_too_much_says_so(refused, tmp_path):
    steps = [{"observe": [0, 1]}, *[{"act": "flip"}, {"observe": [0, 1]}] * 40]
    (tmp_path / "long.json").write_text(json.dumps({**SCRIPT, "steps": steps}))
    assert "engine 'enumeration'" in refused("replay", tmp_path / "long.json", "--engine", "enumeration")


def test_a_trial_learns_and_the_next_one_recognises(run, tmp_path):
    memory, record = tmp_path / "memory.json", tmp_path / "trial.jsonl"
    quick = ["trial", "--engine", "bayes-filter", "--actions", "12", "--seed", "3", "--save-memory", memory]
    status, output, _ = run(*quick, "--record", record)
    assert status == 0
    assert "verdict: a new object" in output
    assert memory_files.load_memory(memory).names == ("object-000",)
    assert json.loads(record.read_text().splitlines()[-1])["verdict"]["judged_novel"]
    status, output, _ = run(*quick, "--memory", memory, "--json", "-")
    document = json.loads(output)
    assert document["matched"] == document["learned"] == "object-000"


def test_a_trial_ends_when_it_is_settled(run):
    document = json.loads(run("trial", "--engine", "bayes-filter", "--settled", "0.1", "--json", "-")[1])
    assert document["parameters"]["settled"] == 0.1
    assert [step["purpose"] for step in document["steps"]] == ["settled"]


def test_a_trial_refuses_what_it_could_not_save(refused, tmp_path):
    assert "cannot be written" in refused("trial", "--record", tmp_path / "no" / "record.jsonl")
    assert "cannot be read" in refused("trial", "--memory", tmp_path / "absent.json")


def test_a_trial_takes_what_the_world_says_for_granted(run, refused, tmp_path):
    memory = tmp_path / "memory.json"
    quick = ["trial", "--engine", "bayes-filter", "--actions", "3"]
    status, output, _ = run(*quick, "--world", "lid-box", "--save-memory", memory)
    assert status == 0
    assert "right" in output
    assumptions = memory_files.load_memory(memory).assumptions
    assert (assumptions.n_objects, assumptions.n_aspects, assumptions.actions[0]) == (100, 8, "open")
    assert run(*quick, "--world", "lid-box", "--memory", memory)[0] == 0
    assert "expected 3 actions and looks of 3 slots with numbers from -1, missing, to 11" in refused(
        *quick, "--memory", memory
    )


def test_an_unknown_command_is_refused(refused):
    assert "No such command 'magic'" in refused("magic")


def test_structure_is_learned_from_trial_to_trial(run, tmp_path):
    file = tmp_path / "memory.json"
    assert run("trial", "--preset", "learned", "--save-memory", file)[0] == 0
    assert run("trial", "--preset", "learned", "--seed", "1", "--memory", file, "--save-memory", file)[0] == 0
    assert len(memory_files.load_memory(file).learner.trials) == 2
    # Other presets and engines take the same file.
    assert run("trial", "--seed", "2", "--memory", file, "--engine", "bayes-filter")[0] == 0


def test_a_memory_of_before_begins_to_learn_structure(run, tmp_path):
    file = tmp_path / "memory.json"
    assert run("trial", "--engine", "bayes-filter", "--save-memory", file)[0] == 0
    assert "structure" not in json.loads(file.read_text())
    assert run("trial", "--preset", "learned", "--memory", file, "--save-memory", file)[0] == 0
    assert len(memory_files.load_memory(file).learner.trials) == 1
