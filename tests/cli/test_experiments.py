import csv
import json
import os

import pytest

from atg_fg.cli.experiments import parse_actions
from atg_fg.core.errors import InvalidInputError

QUICK = ["--engine", "bayes-filter", "--trials", "8", "--jobs", "1"]


def test_table1_prints_json_in_the_promised_shape(run):
    status, output, error = run("table1", *QUICK, "--tests", "2", "--actions", "4", "--seed", "7", "--json", "-")
    assert (status, error) == (0, "")
    document = json.loads(output)
    assert document["command"] == "table1"
    assert document["parameters"]["actions"] == 4
    assert [test["seed"] for test in document["tests"]] == [7, 8]
    for test in document["tests"]:
        assert test["identification"][1] == 8
        assert 0 <= test["recognition"][0] <= test["recognition"][1]
        assert 0 <= test["success"] <= 1
    low, high = document["interval95"]["success"]
    assert low <= document["average"]["success"] <= high
    low, high = document["between95"]["success"]
    assert 0 <= low < document["average"]["success"] < high <= 1


def test_table1_shows_the_papers_row_beside_ours(run):
    status, output, _ = run("table1", *QUICK, "--tests", "1", "--actions", "3")
    assert status == 0
    assert "Correct identification" in output
    assert "paper" in output
    assert "79.2%" in output
    assert "95% interval" in output
    assert "between tests" not in output
    assert "between tests" in run("table1", *QUICK, "--tests", "2", "--actions", "3")[1]


def test_table1_of_other_objects_is_not_held_against_the_paper(run):
    status, output, _ = run("table1", *QUICK, "--tests", "1", "--actions", "3", "--world", "lock")
    assert (status, "79.2%" in output) == (0, False)


@pytest.mark.slow
def test_table1_is_the_same_for_any_number_of_jobs(run, tmp_path):
    for jobs in (1, 2):
        run("table1", *QUICK[:-1], jobs, "--tests", "2", "--actions", "3", "--json", tmp_path / f"{jobs}.json")
    assert (tmp_path / "1.json").read_bytes() == (tmp_path / "2.json").read_bytes()


@pytest.mark.parametrize("world", ["prism", "lid-box", "lock"])
def test_table1_and_figure3_take_what_the_world_says_for_granted(run, world):
    for command, score in (("table1", "average"), ("figure3", "points")):
        arguments = ["--world", world, "--tests", "1", "--actions", "3", "--slip", "0.1", "--json", "-"]
        status, output, error = run(command, *QUICK, *arguments)
        assert (status, error) == (0, "")
        document = json.loads(output)
        assert document["parameters"]["world"] == world
        assert document[score]


def test_noise_of_the_world_is_an_option(run):
    arguments = ["--slip", "0.2", "--wrong", "0.1", "--missing", "0.1", "--json", "-"]
    status, output, _ = run("table1", *QUICK, "--tests", "1", "--actions", "3", *arguments)
    assert status == 0
    assert json.loads(output)["parameters"]["slip"] == 0.2


def test_figure3_writes_json_csv_and_the_plot(run, tmp_path):
    files = {name: tmp_path / f"figure3.{name}" for name in ("json", "csv", "png")}
    status, output, _ = run(
        "figure3", "--actions", "2,4", "--tests", "1", "--trials", "6", "--jobs", "1",
        "--json", files["json"], "--csv", files["csv"], "--plot", files["png"],
    )  # fmt: skip
    assert status == 0
    assert "random" in output
    document = json.loads(files["json"].read_text())
    assert document["command"] == "figure3"
    assert [(p["actions"], p["policy"]) for p in document["points"]] == [
        (2, "entropy"),
        (2, "random"),
        (4, "entropy"),
        (4, "random"),
    ]
    rows = list(csv.DictReader(files["csv"].read_text().splitlines()))
    assert [float(row["success"]) for row in rows] == [p["success"] for p in document["points"]]
    assert files["png"].read_bytes().startswith(b"\x89PNG")


def test_numbers_of_actions_are_a_range_or_a_list():
    assert parse_actions("4:7") == [4, 5, 6, 7]
    assert parse_actions("10") == [10]
    assert parse_actions("4,10,6") == [4, 10, 6]


@pytest.mark.parametrize("text", ["", "4:", "7:4", "0:3", "0", "a", "4,4", "1:2:3", "1.5"])
def test_other_numbers_of_actions_are_refused(text):
    with pytest.raises(InvalidInputError, match=r"--actions: .*expected first:last or a list"):
        parse_actions(text)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--engine", "magic"], "engine: unknown name 'magic'; expected one of: bayes-filter, enumeration, gibbs,"),
        (["--world", "magic"], "world: unknown name 'magic'; expected one of: detector, half-and-half, ideal, lid-box"),
        (["--world", "nowhere:some/World-v0"], "world 'nowhere:some/World-v0': cannot be made"),
        (["--preset", "magic"], "preset: unknown name 'magic'; expected one of: default, learned, paper"),
        (["--policy", "magic"], "policy: unknown name 'magic'; expected one of: entropy, explore, lookahead-2"),
        (["--actions", "0"], "'--actions': Input should be greater than or equal to"),
        (["--tests", "-1"], "'--tests': Input should be greater than or equal to"),
        (["--jobs", "0"], "'--jobs': Input should be greater than or equal to"),
        (["--seed", "-1"], "'--seed': Input should be greater than or equal to"),
        (["--slip", "1.5"], "--slip: 1.5; expected a probability from 0 to 1"),
        (["--wrong", "nan"], "--wrong: nan; expected a probability from 0 to 1"),
        (["--tests", "x"], "'--tests'"),
        (["--magic"], "No such option"),
        (["--json", "no/such/folder/out.json"], "no/such/folder/out.json: cannot be written"),
    ],
)
def test_table1_refuses_bad_input_in_one_line(refused, arguments, message):
    assert message in refused("table1", *arguments)


def test_figure3_refuses_what_it_could_not_write_before_it_starts(refused, tmp_path):
    assert "suffix 'jpeg'; expected .png" in refused("figure3", "--plot", tmp_path / "figure.jpeg")
    assert "cannot be written" in refused("figure3", "--csv", tmp_path / "no" / "points.csv")
    assert os.listdir(tmp_path) == []


def test_the_preset_learned_chooses_its_engine(run, refused):
    quick = ["--preset", "learned", "--trials", "4", "--actions", "3", "--tests", "1", "--jobs", "1"]
    status, output, _ = run("table1", *quick, "--json", "-")
    assert status == 0
    assert json.loads(output)["parameters"]["engine"] == "learned-structure"
    assert "engine 'gtsam': does not know learn_structure" in refused("table1", *quick, "--engine", "gtsam")
    assert json.loads(run("table1", *QUICK[2:], "--tests", "1", "--json", "-")[1])["parameters"]["engine"] == "gtsam"


def test_table1_says_how_many_actions_settled_trials_took(run):
    arguments = ["table1", *QUICK, "--tests", "2", "--actions", "12", "--settled", "0.1"]
    document = json.loads(run(*arguments, "--json", "-")[1])
    assert document["parameters"]["settled"] == 0.1
    low, high = document["actions_a_trial"]["interval95"]
    assert low <= document["actions_a_trial"]["mean"] <= high <= 12
    assert "actions a trial" in run(*arguments)[1]


def test_table1_without_settled_says_nothing_of_it(run):
    document = json.loads(run("table1", *QUICK, "--tests", "1", "--json", "-")[1])
    assert "actions_a_trial" not in document
    assert "settled" not in document["parameters"]


@pytest.mark.parametrize("command", ["table1", "trial"])
def test_an_entropy_that_settles_nothing_is_refused(refused, command):
    assert "settled: inf; expected a finite entropy above 0 nats" in refused("goal", "--settled", "inf")
    assert "--settled: 0.0; expected a finite entropy above 0 nats" in refused(command, "--settled", "0")


def test_a_world_takes_options_of_its_own(run, refused):
    quick = ["table1", *QUICK, "--tests", "1", "--actions", "3", "--world", "random-atg"]
    document = json.loads(run(*quick, "--world-option", "n_successors=1", "--json", "-")[1])
    assert document["parameters"]["n_successors"] == 1
    assert "expected NAME=VALUE" in refused(*quick, "--world-option", "n_successors")
    assert "n_successors" in refused(*quick, "--world-option", "n_successors=none")
    assert "colour" in refused(*quick, "--world-option", "colour=red")


def test_table1_takes_a_policy_of_ones_own(run, refused, tmp_path, monkeypatch):
    (tmp_path / "own_agent.py").write_text(
        "class Agent:\n    def predict(self, observation, deterministic):\n        return 1, None\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    arguments = ["table1", *QUICK, "--tests", "1", "--jobs", "1"]
    status, output, _ = run(*arguments, "--policy", "own_agent:Agent", "--json", "-")
    assert status == 0
    assert json.loads(output)["parameters"]["policy"] == "own_agent:Agent"
    assert "policy 'own_agent:nobody': own_agent has no 'nobody'" in refused(*arguments, "--policy", "own_agent:nobody")


@pytest.mark.parametrize("command", ["table1", "figure3", "ablation"])
def test_more_tests_than_anyone_can_wait_for_are_refused_at_once(refused, command):
    assert "'--tests'" in refused(command, "--tests", "1000000000")
