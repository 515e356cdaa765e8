import json
import math

import pytest

from atg_fg.storage.uai import read_evidence, read_model
from tests.experiments.test_replay import SCRIPT

#: Weights of the four assignments: 0.25, 0.75, 3.75, 0.
MODEL = "MARKOV 2 2 2 2 1 0 2 0 1 2 0.25 0.75 4 1 3 5 0"


@pytest.fixture
def model(tmp_path):
    path = tmp_path / "model.uai"
    path.write_text(MODEL)
    return path


def test_marginals_are_printed_as_the_competitions_have_them(run, model):
    status, output, error = run("uai", "solve", model, "--task", "MAR")
    assert (status, error) == (0, "")
    task, line = output.splitlines()
    assert task == "MAR"
    n_variables, *words = line.split()
    assert (n_variables, words[0], words[3]) == ("2", "2", "2")
    numbers = [float(words[index]) for index in (1, 2, 4, 5)]
    assert numbers == pytest.approx([1 / 4.75, 3.75 / 4.75, 4 / 4.75, 0.75 / 4.75], rel=1e-14)


def test_the_partition_function_is_printed_as_its_logarithm_to_base_10(run, model, tmp_path):
    task, line = run("uai", "solve", model, "--task", "PR")[1].splitlines()
    assert task == "PR"
    assert float(line) == pytest.approx(math.log10(4.75), abs=1e-15)
    evidence = tmp_path / "seen.evid"
    for text in ("1 1 1", "1 1 1 1"):
        evidence.write_text(text)
        line = run("uai", "solve", model, "--task", "PR", "--evidence", evidence)[1].splitlines()[1]
        assert float(line) == pytest.approx(math.log10(0.75), abs=1e-15)


def test_the_most_probable_explanation_is_printed_with_the_number_of_variables(run, model):
    assert run("uai", "solve", model, "--task", "MPE")[:2] == (0, "MPE\n2 1 0\n")


def test_results_leave_as_json_too(run, model, tmp_path):
    for task, key in (("MAR", "marginals"), ("PR", "log_partition"), ("MPE", "states")):
        assert run("uai", "solve", model, "--task", task, "--json", tmp_path / "out.json")[1].startswith(task)
        document = json.loads((tmp_path / "out.json").read_text())
        assert (document["command"], document["task"]) == ("uai solve", task)
        assert key in document
        assert json.loads(run("uai", "solve", model, "--task", task, "--json", "-")[1]) == document
    assert document["states"] == [1, 0]
    assert math.exp(document["log_weight"]) == pytest.approx(3.75)


def test_what_cannot_be_solved_is_one_line(refused, model, tmp_path):
    assert "--task: 'SUM'; expected one of: MAR, PR, MPE" in refused("uai", "solve", model, "--task", "SUM")
    assert "'--limit': Input should be greater than or equal to 1" in refused(
        "uai", "solve", model, "--task", "PR", "--limit", 0
    )
    assert "4 entries (32 bytes); the limit is 3" in refused("uai", "solve", model, "--task", "PR", "--limit", 3)
    assert "cannot be read" in refused("uai", "solve", tmp_path / "absent.uai", "--task", "PR")
    evidence = tmp_path / "seen.evid"
    for text, says in (
        ("1 1 2", "seen.evid: state 2 of variable 1; expected 0 to 1"),
        ("1 2 0", "seen.evid: variable 2"),
        ("2 0 1 1 1", "weight zero"),
        ("2 0", "seen.evid: line 1: number of samples: '2'; expected 1"),
    ):
        evidence.write_text(text)
        assert says in refused("uai", "solve", model, "--task", "MAR", "--evidence", evidence)


def test_text_after_the_last_table_is_noted_beside_the_answer(run, model):
    plain = run("uai", "solve", model, "--task", "PR")
    model.write_text(MODEL + " # a comment\n 7")
    status, output, error = run("uai", "solve", model, "--task", "PR")
    assert (status, output) == plain[:2]
    assert error.endswith("model.uai: line 2: 1 words after the last table are ignored: '7'\n")


STEPS = [
    {"observe": [0, 1]},
    {"act": "flip"},
    {"observe": [1, 5]},
    {"act": "left"},
    {"observe": [None, 5]},
    {"act": "flip"},
    {"observe": [2, 1]},
    {"act": "right"},
]
OTHER = {
    "name": "cube-001",
    "aspects": [[1, 5], [0, 1], [2, 1]],
    "transitions": [{"from": 1, "action": "flip", "to": 0, "count": 2}],
}


@pytest.mark.parametrize("learn", [False, True])
@pytest.mark.parametrize("n_steps", [1, 3, 7, 8])
def test_an_exported_trial_solved_has_the_posterior_that_replay_prints(run, tmp_path, learn, n_steps):
    script, model, evidence = (tmp_path / name for name in ("script.json", "trial.uai", "trial.evid"))
    parameters = {"transition_concentration": 0.05, "observation_noise": 0.01, "learn_in_trial": learn}
    memory = [*SCRIPT["memory"], OTHER]
    script.write_text(json.dumps({**SCRIPT, "parameters": parameters, "memory": memory, "steps": STEPS[:n_steps]}))
    status, output, _ = run("uai", "export", script, "--model", model, "--evidence", evidence)
    assert status == 0
    n_aspects, n_looks = 1 + n_steps // 2, (1 + n_steps) // 2
    assert f"{1 + n_aspects + n_looks} variables, O, X0" in output
    # Complete looks are evidence about patterns; the partial one is a factor.
    observed = read_evidence(evidence.read_text())
    assert len(observed) == n_looks - (n_steps >= 5)
    read = read_model(model.read_text())
    read.check_evidence(observed)
    assert [scope for scope, _ in read.factors if len(scope) == 1 and scope != (0,)] == (
        [(1 + n_aspects + 2,)] if n_steps >= 5 else []
    )
    last = json.loads(run("replay", script, "--engine", "bayes-filter")[1])["steps"][-1]
    solved = ("uai", "solve", model, "--evidence", evidence, "--json", "-", "--task")
    identity = json.loads(run(*solved, "MAR")[1])["marginals"][0]
    assert identity == pytest.approx([*last["objects"].values(), last["unseen"]], abs=1e-9)
    assert json.loads(run(*solved, "PR")[1])["log_partition"] == pytest.approx(last["log_evidence"], abs=1e-9)


def test_an_unseen_pattern_of_an_exported_trial_has_the_predicted_distribution(run, tmp_path):
    """Without evidence about its last look, Z has the distribution that the tables of all patterns give."""
    script, model, evidence = (tmp_path / name for name in ("script.json", "trial.uai", "trial.evid"))
    script.write_text(json.dumps({**SCRIPT, "steps": STEPS[:1]}))
    run("uai", "export", script, "--model", model, "--evidence", evidence)
    (pattern,) = json.loads(run("uai", "solve", model, "--task", "MAR", "--json", "-")[1])["marginals"][2:]
    evidence_probability = json.loads(
        run("uai", "solve", model, "--evidence", evidence, "--task", "PR", "--json", "-")[1]
    )
    (seen,) = read_evidence(evidence.read_text()).values()
    assert pattern[seen] == pytest.approx(math.exp(evidence_probability["log_partition"]), abs=1e-12)


def test_an_export_that_cannot_be_written_or_is_too_large_is_refused(refused, tmp_path):
    script = tmp_path / "script.json"
    script.write_text(json.dumps(SCRIPT))
    export = ("uai", "export", script, "--model", tmp_path / "m.uai", "--evidence")
    assert "expected another file" in refused(*export, tmp_path / "m.uai")
    assert "cannot be written" in refused(*export, tmp_path / "no" / "e.evid")
    assumptions = {**SCRIPT["assumptions"], "n_symbols": 300}
    steps = [{"observe": [0, 1]}, *[{"act": "flip"}, {"observe": [1, 5]}] * 40]
    script.write_text(json.dumps({**SCRIPT, "assumptions": assumptions, "steps": steps}))
    assert "the limit is 16777216 entries" in refused(*export, tmp_path / "e.evid")
    assert not (tmp_path / "m.uai").exists()


@pytest.mark.parametrize("command", ["solve", "export"])
def test_help_carries_an_example(run, command):
    assert f"Example: atg-fg uai {command}" in run("uai", command, "--help")[1]
