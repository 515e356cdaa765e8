"""Another revision is timed with its own code, and no other library but its own differs."""

import subprocess
import sys
from pathlib import Path

import pytest

from atg_fg.core.errors import InvalidInputError
from benchmarks import against
from benchmarks.against import Figure, Side, commit_of, measure


@pytest.fixture
def repository(tmp_path, monkeypatch):
    """A project of one file, whose first revision is told apart from the second."""
    monkeypatch.setattr(against, "ROOT", tmp_path)
    (tmp_path / "benchmarks").mkdir()
    turns = (
        "import sys, project\nfor line in sys.stdin:\n    print(f'{{\"seconds\": [{project.SECONDS}]}}', flush=True)\n"
    )
    (tmp_path / "benchmarks" / "turns.py").write_text(turns)
    for seconds in (6.0, 2.0):
        (tmp_path / "project.py").write_text(f"SECONDS = {seconds}\n")
        for command in (
            ["init", "-q"],
            ["add", "-A"],
            ["-c", "user.name=a", "-c", "user.email=a@b", "commit", "-qm", "one"],
        ):
            subprocess.run(["git", "-C", str(tmp_path), *command], check=True)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))  # which would come before what is installed
    return tmp_path


@pytest.mark.slow
def test_the_turns_of_a_revision_run_its_own_code(repository):
    for revision, seconds in (("HEAD~1", 6.0), ("HEAD", 2.0)):
        with against.built(commit_of(revision)) as earlier, Side(*earlier) as side:
            assert side.turn("any", {}) == {"seconds": seconds}


def test_an_unknown_revision_is_one_error(repository):
    for revision in ("nowhere", "--all", ""):
        with pytest.raises(InvalidInputError, match="--against"):
            measure(revision)


def test_a_side_that_dies_is_not_waited_for(repository):
    (repository / "benchmarks" / "turns.py").write_text("")
    with Side(Path(sys.executable), repository) as side, pytest.raises(RuntimeError, match="ended in turn 'any'"):
        side.turn("any", {})


def test_ratios_are_of_the_earlier_code_to_the_present(monkeypatch, tmp_path):
    seconds = {"old": iter([9.0, 8.0, 6.0, 4.0]), "new": iter([9.0, 2.0, 2.0, 2.0])}

    class Told:
        def __init__(self, python, home=None):
            self._name = "old" if python == tmp_path else "new"

        def __enter__(self):
            return self

        def __exit__(self, *error):
            pass

        def turn(self, name, arguments):
            return {"seconds": next(seconds[self._name])}

    class Built:
        def __init__(self, commit):
            pass

        __enter__, __exit__ = lambda self: (tmp_path, tmp_path), lambda self, *error: None

    monkeypatch.setattr(against, "Side", Told)
    monkeypatch.setattr(against, "built", Built)
    monkeypatch.setattr(against, "commit_of", lambda revision: "c0ffee")
    found = measure("main", (Figure("claim", ("any", {}), "seconds", 2.5, rounds=3),))
    (row,) = found["figures"]
    assert (row["times_as_quick"]["median"], row["met"], row["target"]) == (3.0, True, 2.5)
    assert (row["milliseconds"]["before"]["median"], row["milliseconds"]["now"]["median"]) == (6000.0, 2000.0)
