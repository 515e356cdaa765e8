import json

import pytest

QUICK = ["ablation", "--variants", "paper;default", "--actions", "3", "--noises", "ideal"]
QUICK += ["--tests", "1", "--trials", "5", "--jobs", "1"]


def test_it_prints_json_in_the_promised_shape(run):
    status, output, error = run(*QUICK, "--json", "-")
    assert (status, error) == (0, "")
    document = json.loads(output)
    assert document["command"] == "ablation"
    assert [cell["variant"] for cell in document["cells"]] == ["paper", "default"]
    for cell in document["cells"]:
        low, high = cell["interval95"]
        assert low <= cell["success"] <= high


def test_it_shows_a_table_and_a_plot_and_keeps_a_log(run, tmp_path):
    arguments = [*QUICK, "--log", tmp_path / "log.jsonl", "--plot", tmp_path / "plot.png"]
    status, output, _ = run(*arguments)
    assert status == 0
    assert "Success, ideal world, ideal, 1 tests of 5 trials" in output
    assert (tmp_path / "plot.png").read_bytes().startswith(b"\x89PNG")
    assert len((tmp_path / "log.jsonl").read_text().splitlines()) == 3
    assert run(*arguments)[1] == output


def test_other_worlds_have_panels_of_their_own(run):
    document = json.loads(run(*QUICK, "--worlds", "lid-box,lock", "--json", "-")[1])
    assert [cell["world"] for cell in document["cells"]] == ["lid-box"] * 2 + ["lock"] * 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--variants", "magic"], "'magic'; expected one of: default, learned, learned + lookahead, paper"),
        (["--variants", "paper;paper"], "expected each name once"),
        (["--noises", "loud"], "'loud'"),
        (["--worlds", "moon"], "'moon'"),
        (["--actions", "0"], "--actions: '0'"),
        (["--tests", "0"], "'--tests': Input should be greater than or equal to 1"),
        (["--plot", "curves.gif"], "suffix 'gif'"),
        (["--log", "/nowhere/at/all.jsonl"], "/nowhere/at/all.jsonl"),
    ],
)
def test_bad_options_are_one_line(refused, arguments, message):
    assert message in refused(*QUICK, *arguments)
