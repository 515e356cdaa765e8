"""Which commands begin what forks their workers before they are imported."""

import os

import pytest
from typer.main import get_command

from atg_fg.cli import COMMANDS, app, early_workers
from atg_fg.experiments.executors import fork_server


@pytest.fixture
def begun(monkeypatch):
    monkeypatch.setattr(early_workers.sys, "platform", "linux")
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1}, raising=False)
    calls = []
    monkeypatch.setattr(fork_server, "begin_early", lambda: calls.append(1))
    return calls


@pytest.mark.parametrize("arguments", [[], ["--jobs", "2"], ["--jobs=12", "--seed", "1"], ["--tests", "10"]])
def test_it_is_begun_for_a_command_that_has_workers(arguments, begun):
    early_workers.begin_workers_early(arguments)
    assert begun == [1]


@pytest.mark.parametrize(
    "arguments", [["--help"], ["--jobs", "1"], ["--seed", "2", "--jobs=1"], ["--tests", "1"], ["--executor", "thread"]]
)
def test_it_is_not_begun_for_one_that_has_none(arguments, begun):
    early_workers.begin_workers_early(arguments)
    assert begun == []


def test_it_is_not_begun_on_one_processor(begun, monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0})
    early_workers.begin_workers_early([])
    assert begun == []


def test_those_commands_have_it_that_can_be_given_a_number_of_jobs(begun, capsys):
    commands = get_command(app).commands
    for name in [name for panel in COMMANDS.values() for name in panel]:
        has_jobs = any("--jobs" in each.opts for each in commands[name].load().params)
        with pytest.raises(SystemExit):
            commands[name].main(["--no-such-option"])
        assert len(begun) == has_jobs, name
        begun.clear()
