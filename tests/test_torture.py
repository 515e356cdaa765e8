"""A little of what ``make torture`` does."""

import subprocess
import sys
from contextlib import suppress
from importlib.util import find_spec
from pathlib import Path

import pytest

from atg_fg.core.errors import AtgError
from atg_fg.storage.database.connection import DistrustfulConnection
from tests.torture.fuzz import CORPUS, KINDS, as_file
from tests.torture.power import cut_power, library_of_python
from tests.torture.reading import read_as

ROOT = Path(__file__).parents[1]


def tortured(*arguments: str) -> str:
    """Run in a process of its own: it forks, mounts and limits itself."""
    command = [sys.executable, "-m", "tests.torture", "--seed", "1", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


NONE = {"--kills": 0, "--cuts": 0, "--points": 0, "--files": 0, "--fuzz": 0, "--jobs": 1}


def only(**parts: int) -> list[str]:
    """Return the options that leave out all parts but these."""
    given = NONE | {f"--{name}": number for name, number in parts.items()}
    return [str(word) for option in given.items() for word in option]


@pytest.fixture(scope="module")
def a_little() -> str:
    """What is printed of a few killed writers and damaged files."""
    return tortured(*only(kills=2, files=20))


def test_a_killed_writer_leaves_every_trial_that_it_said_was_written(a_little: str) -> None:
    assert "2 of 2" in a_little


@pytest.mark.slow
def test_a_power_cut_leaves_every_trial_that_was_said_to_be_kept() -> None:
    output = tortured(*only(cuts=1))
    assert "log of trials: " in output
    assert output.endswith("0 faults, seed 1\n")


@pytest.mark.slow
def test_a_full_disk_and_a_read_only_folder_leave_the_old_state() -> None:
    output = tortured(*only(points=1, commands=6))
    assert "full, database: 1 well" in output
    assert "full, atg-fg table1: 2 well" in output
    assert output.endswith("0 faults, seed 1\n")


def test_damaged_files_are_refused_with_an_error_of_this_project(a_little: str) -> None:
    assert "20 of 20" in a_little


@pytest.mark.slow
@pytest.mark.skipif(find_spec("atheris") is None, reason="atheris is not installed: pip install --group torture")
def test_readers_are_fuzzed() -> None:
    assert "; 0 faults" in tortured(*only(fuzz=3))


def test_the_corpus_is_small_and_leads_to_no_fault(tmp_path: Path) -> None:
    kept = list(CORPUS.iterdir())
    assert 20 < len(kept) < 500
    assert sum(path.stat().st_size for path in kept) < 400_000
    kinds = set()
    for path in kept:
        kind, content = as_file(path.read_bytes())
        kinds.add(kind)
        with suppress(AtgError):
            read_as(kind, content, tmp_path)
    assert kinds == set(KINDS)


@pytest.mark.slow
def test_a_writer_that_does_not_sync_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """The simulated power cut can fail: this is what it is for."""
    if library_of_python() is None:
        pytest.skip("SQLite is a part of this Python")
    execute = DistrustfulConnection.execute

    def unsynced(self: DistrustfulConnection, statement: str, *rest: object) -> object:
        return execute(self, statement.replace("synchronous = FULL", "synchronous = OFF"), *rest)

    monkeypatch.setattr(DistrustfulConnection, "execute", unsynced)
    assert any("0 trials found, 1 ended" in fault for fault in cut_power(1, 0)["faults"])


@pytest.mark.slow
def test_more_of_the_torture_is_survived() -> None:
    assert "0 faults" in tortured(*only(kills=300, cuts=4, points=4, files=3000, fuzz=60))
