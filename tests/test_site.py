"""What the site makes from the code itself: the picture of the floors, and the list of public names."""

import importlib.util
import re
import sys
from pathlib import Path

import pytest

import atg_fg

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"


def module(name, needs):
    pytest.importorskip(needs, reason=f"{needs} is not installed: make setup")
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    loaded = importlib.util.module_from_spec(spec)
    sys.modules[name] = loaded
    spec.loader.exec_module(loaded)
    return loaded


@pytest.fixture(scope="module")
def floors():
    return module("floors", "grimp")


def packages():
    return {f"atg_fg.{path.parent.name}" for path in (ROOT / "atg_fg").glob("*/__init__.py")}


def test_the_picture_has_every_package_with_its_files_and_only_lines_that_run_down(floors):
    drawn = floors.picture()
    boxes = dict(re.findall(r">([\w.]+)</text><text [^>]*>(\d+) files<", drawn))
    assert set(boxes) == packages() | {"sim", "benchmarks"}
    assert int(boxes["atg_fg.core"]) == len(list((ROOT / "atg_fg" / "core").rglob("*.py")))
    ends = re.findall(r'd="M\d+ (\d+)C.*? \d+ (\d+)"', drawn)
    assert len(ends) > 40
    assert all(int(above) < int(below) for above, below in ends)


def test_the_floors_are_those_of_the_check(floors):
    levels = floors.floors()
    assert levels[0] == ["atg_fg.core"]
    assert [levels[-2], levels[-1]] == [["sim"], ["benchmarks"]]


def test_the_reference_begins_with_the_public_names_and_has_every_package():
    page = (DOCS / "api.md").read_text()
    public, modules = page.split("## Packages")
    assert packages() | {"sim"} == set(re.findall(r"^   (\S+)$", modules, re.MULTILINE)) - {":recursive:"}
    place = module("public_names", "sphinx")._place
    shown = re.findall(r"public-names:: (\S+)", public)
    for name in atg_fg.__all__:
        assert place(name).endswith(f".{name}")
        assert any(place(name).startswith(f"{package}.") for package in shown), name


def test_no_summary_ends_where_it_names_an_equation():
    module("public_names", "sphinx")
    from docutils.core import Publisher
    from docutils.parsers.rst import Parser
    from sphinx.ext.autosummary import extract_summary

    settings = Publisher(parser=Parser()).get_settings()
    line = "Return p(O | z_0:t), as the filter does (eq. 1 and 2). Nothing else."
    assert extract_summary([line], settings) == "Return p(O | z_0:t), as the filter does (eq. 1 and 2)."
