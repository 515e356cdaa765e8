"""A little of what ``make torture`` does."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


def tortured(*arguments: str) -> str:
    """Run in a process of its own: it forks, mounts and limits itself."""
    command = [sys.executable, "-m", "tests.torture", "--seed", "1", *arguments]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_a_killed_writer_leaves_every_trial_that_it_said_was_written() -> None:
    assert "30 of 30" in tortured("--kills", "30", "--points", "0", "--files", "0")


def test_a_full_disk_and_a_read_only_folder_leave_the_old_state() -> None:
    output = tortured("--kills", "0", "--points", "3", "--files", "0")
    assert "full, database: 3 well" in output
    assert output.endswith("0 faults, seed 1\n")


def test_damaged_files_are_refused_with_an_error_of_this_project() -> None:
    assert "140 of 140" in tortured("--kills", "0", "--points", "0", "--files", "140", "--jobs", "1")


@pytest.mark.slow
def test_all_of_the_torture_is_survived() -> None:
    assert "0 faults" in tortured()
