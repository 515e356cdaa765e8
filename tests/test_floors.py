"""`make lint` holds the floors: a copy of the tree with one wrong import, or one file too many, is refused."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LINT = "import sys; from importlinter.cli import lint_imports; sys.exit(lint_imports(cache_dir=None))"
UPWARD = "from atg_fg.storage import presets"


#: What lies on the top level, and nothing else.
FOLDERS = {".ci", "atg_fg", "benchmarks", "docs", "notebooks", "results", "sim", "tests"}


def test_the_top_level_holds_no_folder_that_a_run_has_left():
    if not (ROOT / ".git").exists():
        pytest.skip("not a checkout")
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert {line.partition("/")[0] for line in tracked.splitlines() if "/" in line} == FOLDERS


@pytest.fixture
def tree(tmp_path):
    for name in ("atg_fg", "sim", "benchmarks"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return tmp_path


def checked(tree):
    """Return the status of the check in the folder, and what it printed."""
    code = f"import sys; sys.path.insert(0, {str(tree)!r}); {LINT}"
    done = subprocess.run([sys.executable, "-P", "-c", code], cwd=tree, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout


def test_the_tree_as_it_stands_passes(tree):
    assert checked(tree)[0] == 0


@pytest.mark.parametrize(
    "planted",
    [
        UPWARD,
        f"from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    {UPWARD}",
        f"def late():\n    {UPWARD}",
        "import sim",
    ],
    ids=["of a module", "for types alone", "in a function", "of the simulator"],
)
def test_an_import_that_runs_up_is_refused(tree, planted):
    (tree / "atg_fg" / "core" / "planted.py").write_text(planted + "\n")
    status, printed = checked(tree)
    assert status == 1
    assert "atg_fg.core.planted" in printed


def test_an_import_of_a_package_on_the_same_floor_is_refused(tree):
    (tree / "atg_fg" / "worlds" / "planted.py").write_text("import atg_fg.inference.chain\n")
    assert checked(tree)[0] == 1


def test_a_circle_within_a_package_is_refused(tree):
    (tree / "atg_fg" / "core" / "one.py").write_text("import atg_fg.core.two\n")
    (tree / "atg_fg" / "core" / "two.py").write_text("import atg_fg.core.one\n")
    assert checked(tree)[0] == 1


def test_a_module_beside_the_packages_is_refused(tree):
    (tree / "atg_fg" / "loose.py").write_text("")
    status, printed = checked(tree)
    assert status == 1
    assert "loose" in printed
