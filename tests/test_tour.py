"""The tour of commands: they run in their order, and print what the page says."""

import importlib.util
import re
import sys
from pathlib import Path

import pytest

FILE = Path(__file__).parents[1] / "docs" / "tour.py"
#: What makes a command short enough for a test; its output is then another. By the words that call it.
SHORTER = {
    "table1": ["--tests", "1", "--trials", "5"],
    "figure3": ["--trials", "4"],
    "demo": ["--actions", "1"],
    "sim reliability": ["--actions", "1", "--jobs", "1"],
    "engines compare": ["--trials", "1"],
    "engines check": ["--trials", "50"],
    "goal": ["--trials", "2"],
    "ablation": ["--actions", "3", "--tests", "1", "--trials", "4"],
    "watch": ["--actions", "1"],
}
#: Packages of optional extras that a command cannot do without.
NEEDS = {"report": "jinja2", "watch": "rerun", "demo": "pybullet", "sim": "pybullet", "figure3": "matplotlib"}
#: They print times, of which tables are as wide as they are long, or what is installed.
CHANGING = {"doctor", "engines compare", "sim reliability"}


@pytest.fixture(scope="module")
def tour():
    spec = importlib.util.spec_from_file_location("tour", FILE)
    module = importlib.util.module_from_spec(spec)
    sys.modules["tour"] = module
    spec.loader.exec_module(module)
    return module


def words_of(line):
    """The command's name, and that of its group."""
    program, *words = line.split()
    assert program == "atg-fg"
    return words[0], " ".join(words[:2])


def missing(line):
    name, _ = words_of(line)
    return name in NEEDS and importlib.util.find_spec(NEEDS[name]) is None


def check(tour, folder, shorter):
    """Run the tour in a folder; compare what is printed by each command that is run as it is on the page."""
    tour.make_folder(folder)
    compared = 0
    for command in tour.commands():
        if missing(command.line):
            continue
        name, both = words_of(command.line)
        more = shorter.get(both, shorter.get(name, []))
        done = tour.run(command.line, folder, *more)
        assert done.returncode == 0, f"{command.line}: {done.stderr}"
        if more or both in CHANGING:
            continue
        lines = tour.printed(done.stdout)
        assert (len(lines) > len(command.output) + len(command.end)) == command.cut, command.line
        assert command.shown(lines) == (command.output, command.end), command.line
        compared += 1
    return compared


def test_the_robot_recognises_an_object_within_the_first_three_commands(tour):
    assert any(line.startswith("verdict: object-") for each in tour.commands()[:3] for line in each.output)


@pytest.mark.slow
def test_every_command_of_the_tour_runs_and_prints_what_the_page_says(tour, tmp_path):
    assert check(tour, tmp_path, SHORTER) >= 12
    made = {path.name for path in tmp_path.iterdir()}
    assert {"cubes.json", "more.json", "trial.jsonl", "robot.db", "atg.dot", "trial.uai"} <= made


@pytest.mark.slow
def test_the_long_commands_print_what_the_page_says_too(tour, tmp_path):
    check(tour, tmp_path, {})


def test_every_command_of_the_tour_says_its_time_and_its_output(tour):
    page = tour.PAGE.read_text()
    assert page.count("```console") == len(re.findall(r"```\n\n\*Takes \d+( \+ \d+)* s\.\*\n", page))
    silent = {"memory import", "memory export", "uai export"}
    assert all(each.output or words_of(each.line)[1] in silent for each in tour.commands())
