"""What README tells a newcomer is true: its commands run, its Python runs, and its map names every package."""

import importlib.util
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()
TOUR = README.split("## What it does")[1].split("## Results")[0]
COMMANDS = [line.split("#")[0].strip() for line in re.search(r"```sh\n(.*?)```", TOUR, re.DOTALL)[1].splitlines()]
#: What makes a command of the tour short enough for a test; the command is otherwise as it is printed.
SHORTER = {
    "table1": ["--tests", "1", "--trials", "5"],
    "figure3": ["--trials", "4"],
    "demo": ["--actions", "1"],
    "sim": ["--actions", "1", "--jobs", "1"],
    "compare": ["--trials", "1"],
    "goal": ["--trials", "2"],
    "ablation": ["--actions", "3", "--tests", "1", "--trials", "4"],
    "watch": ["--actions", "1"],
}
#: Packages of optional extras that a command cannot do without.
NEEDS = {"report": "jinja2", "watch": "rerun"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("tour")
    (made / "tests").symlink_to(ROOT / "tests")
    return made


def test_the_commands_of_the_tour_run_in_their_order(folder):
    assert len(COMMANDS) >= 7
    for command in COMMANDS:
        program, name, *arguments = shlex.split(command)
        if name in NEEDS and importlib.util.find_spec(NEEDS[name]) is None:
            continue  # of an optional extra
        assert program == "atg-fg"
        script = Path(sys.executable).with_name(program)
        done = subprocess.run(
            [script, name, *arguments, *SHORTER.get(name, [])], cwd=folder, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{command}: {done.stderr}"
    assert {"memory.json", "trial.jsonl", "atg.dot", "figure3.png", "out"} <= {path.name for path in folder.iterdir()}


def test_the_python_of_the_tour_runs(capsys):
    code = re.search(r"```python\n(.*?)```", TOUR, re.DOTALL)[1]
    exec(compile(code, "README.md", "exec"), {})
    assert "1.0" in capsys.readouterr().out


def test_the_map_names_every_package():
    tree = README.split("## Map")[1].split("```")[1]
    packages = {path.parent.name for path in (ROOT / "atg_fg").glob("*/__init__.py")}
    assert packages | {"sim", "benchmarks", "notebooks", "tests", "atg_fg"} == set(re.findall(r"(\w+)/ ", tree))


def test_every_link_and_picture_is_there():
    for target in re.findall(r"\]\(([^)]+)\)", README):
        assert target.startswith("https://") or (ROOT / target).exists(), target


def test_commands_of_the_results_are_those_of_make_results():
    makefile = (ROOT / "Makefile").read_text()
    results = README.split("## Results")[1].split("## Engines")[0]
    for command in re.search(r"```sh\n(.*?)```", results, re.DOTALL)[1].splitlines():
        assert command in makefile
