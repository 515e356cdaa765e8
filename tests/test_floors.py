"""`make lint` holds the floors: a copy of the tree with one wrong import, or one file too many, is refused."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LINT = "import sys; from importlinter.cli import lint_imports; sys.exit(lint_imports(cache_dir=None))"


#: What lies on the top level, and nothing else.
FOLDERS = {".ci", "atg_fg", "benchmarks", "docs", "notebooks", "results", "sim", "tests"}


def test_the_top_level_holds_no_folder_that_a_run_has_left():
    if not (ROOT / ".git").exists():
        pytest.skip("not a checkout")
    tracked = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert {line.partition("/")[0] for line in tracked.splitlines() if "/" in line} == FOLDERS


#: Files of atg_fg that break a rule, and what the check says of each.
UPWARD = "from atg_fg.storage import presets"
PLANTED = {
    "upwards": ("core/upwards.py", UPWARD, "atg_fg.core.upwards -> atg_fg.storage"),
    "upwards, for types alone": (
        "core/for_types.py", f"from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    {UPWARD}",
        "atg_fg.core.for_types -> atg_fg.storage",
    ),
    "upwards, in a function": ("core/late.py", f"def late():\n    {UPWARD}", "atg_fg.core.late -> atg_fg.storage"),
    "of the simulator": ("core/simulated.py", "import sim", "atg_fg is not allowed to import sim"),
    "on the same floor": ("worlds/beside.py", "import atg_fg.inference.chain", "atg_fg.worlds.beside -> atg_fg.infer"),
    "in a circle": ("core/one.py", "import atg_fg.core.two", "No cycles are allowed in atg_fg.core."),
    "and back": ("core/two.py", "import atg_fg.core.one", ".two -> .one"),
    "beside the packages": ("loose.py", "", "not listed as layers: - atg_fg.loose"),
}  # fmt: skip


def checked(folder, planted):
    """Return the status of the check of a copy of the tree with these files in it, and the words that it printed."""
    for name in ("atg_fg", "sim", "benchmarks"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", folder)
    for file, text in planted:
        (folder / "atg_fg" / file).write_text(text + "\n")
    code = f"import sys; sys.path.insert(0, {str(folder)!r}); {LINT}"
    done = subprocess.run([sys.executable, "-P", "-c", code], cwd=folder, capture_output=True, text=True, check=False)
    return done.returncode, " ".join(done.stdout.split())


@pytest.fixture(scope="module")
def all_planted(tmp_path_factory):
    return checked(tmp_path_factory.mktemp("planted"), [(file, text) for file, text, _ in PLANTED.values()])


def test_the_tree_as_it_stands_passes(tmp_path):
    status, printed = checked(tmp_path, [])
    assert status == 0, printed
    assert not any(told in printed for _, _, told in PLANTED.values())


@pytest.mark.parametrize("fault", PLANTED)
def test_what_breaks_a_rule_is_named(all_planted, fault):
    status, printed = all_planted
    assert status == 1
    assert PLANTED[fault][2] in printed


@pytest.mark.slow
@pytest.mark.parametrize("fault", [fault for fault in PLANTED if fault not in ("in a circle", "and back")])
def test_what_breaks_a_rule_is_refused_by_itself(tmp_path, fault):
    file, text, told = PLANTED[fault]
    status, printed = checked(tmp_path, [(file, text)])
    assert status == 1
    assert told in printed
