"""Numbers of which more is asked than memory holds are refused in one line, before anything is made of them."""

import pytest

SCRIPT = "tests/data/scripted_trial.json"
COUNTS = (
    "trial --actions",
    "table1 --actions",
    "table1 --trials",
    "table1 --tests",
    "table1 --objects",
    "table1 --world detector --objects",
    "table1 --world lock --objects",
    "figure3 --trials",
    "figure3 --actions",
    "figure3 --actions 1:",
    "figure3 --actions 1:2:",
    "ablation --actions 3,",
    "ablation --trials",
    "goal --actions",
    "goal --cubes",
    "goal --memory-cubes",
    "goal --learning-actions",
    "goal --trials",
    "engines compare --trials",
    "engines compare --actions",
    "engines compare --objects",
    "engines check --trials",
    f"explain {SCRIPT} --samples",
    "recordings simulate -o looks.csv --objects",
    "recordings simulate -o looks.csv --world mixed --objects",
    "recordings simulate -o looks.csv --trials",
    "recordings simulate -o looks.csv --actions",
    "print cube --cubes",
    "sim reliability --actions",
    "sim reliability --stations",
    "sim webcam --trials",
    "sim webcam --actions",
)


@pytest.mark.parametrize("words", COUNTS)
@pytest.mark.parametrize("number", [2**31 - 1, 10**30])
def test_a_count_of_more_than_memory_holds(refused, words, number):
    if words.startswith("sim"):
        pytest.importorskip("pybullet")
    *rest, last = words.split()
    ends = (":", ",")
    line = refused(*rest, last + str(number)) if last.endswith(ends) else refused(*rest, last, number)
    assert "expected" in line or "Input should be" in line


def test_a_range_that_begins_below_all_numbers(refused):
    assert "expected first:last" in refused("figure3", "--actions=-99999999999:5")


@pytest.mark.parametrize("name", ["n_objects", "objects_seed", "seed"])
def test_what_a_command_says_itself_is_no_option_of_the_world(refused, tmp_path, name):
    for words in (["table1"], ["recordings", "simulate", "-o", tmp_path / "looks.csv"]):
        line = refused(*words, "--world-option", f"{name}=3")
        assert f"{name!r}" in line
        assert "expected" in line
