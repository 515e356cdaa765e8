"""What README tells a newcomer is true: its Python runs, its links lead somewhere, its figures are in results/."""

import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text()


def test_it_is_one_page():
    prose = re.sub(r"```.*?```|!\[[^]]*\]\([^)]*\)|^\*[^*]+\*$|\]\([^)]*\)", "", README, flags=re.DOTALL | re.MULTILINE)
    assert len(prose.split()) <= 900


def test_its_python_runs(capsys):
    (code,) = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    exec(compile(code, "README.md", "exec"), {})
    assert "1.0" in capsys.readouterr().out


def test_its_commands_are_those_of_the_tour():
    tour = (ROOT / "docs" / "tour.md").read_text()
    for command in re.findall(r"^(atg-fg (?:memory|trial) [^#\n]*?) +#", README, re.MULTILINE):
        assert f"$ {command}" in tour


def test_the_map_names_every_package():
    tree = README.split("## Map")[1].split("```")[1]
    packages = {path.parent.name for path in (ROOT / "atg_fg").glob("*/__init__.py")}
    assert set(re.findall(r"atg_fg/(\w+)/ ", tree)) == packages
    assert {"sim", "benchmarks", "notebooks", "tests"} <= set(re.findall(r"^(\w+)/ ", tree, re.MULTILINE))


def test_every_link_and_picture_is_there():
    for target in re.findall(r"\]\(([^)]+)\)", README):
        assert target.startswith("https://") or (ROOT / target).exists(), target


@pytest.mark.parametrize(
    ("words", "file"),
    [
        ("`--preset paper`", "table1_paper"),
        ("`--preset default`", "table1_default"),
        ("`--preset learned`", "table1_learned"),
        ("the simulated robot", "table1_robonaut_nominal_default"),
        ("robonaut-picture-box", "table1_robonaut-picture-box_learned"),
    ],
)
def test_its_results_are_those_in_the_files_that_make_results_leaves(words, file):
    (row,) = [line for line in README.split("## Results")[1].splitlines() if line.startswith("|") and words in line]
    result = json.loads((ROOT / "results" / f"{file}.json").read_text())
    scores = [f"{100 * result['average'][name]:.1f} %" for name in ("identification", "recognition", "success")]
    low, high = result["interval95"]["success"]
    cells = [cell.strip(" *") for cell in row.strip("|").split("|")]
    assert cells[1:] == [str(len(result["tests"])), *scores[:2], f"{scores[2]}** ({100 * low:.1f}–{100 * high:.1f})"]


def test_commands_of_the_results_are_those_of_make_results():
    makefile = (ROOT / "Makefile").read_text()
    for page in ("README.md", "docs/experiments.md"):
        text = (ROOT / page).read_text()
        for command in re.findall(r"^(atg-fg table1 --(?:preset|world) .*)$", text, re.MULTILINE):
            assert command in makefile
