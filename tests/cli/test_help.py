"""Help of the command line: each command says what it does and gives an example."""

import pytest
import typer

from atg_fg import cli


def commands(command, path=()):
    """All commands, as the words that call them; groups too."""
    yield path
    for name, below in getattr(command, "commands", {}).items():
        yield from commands(below, (*path, name))


@pytest.mark.parametrize("path", list(commands(typer.main.get_command(cli.app))), ids=" ".join)
def test_help_of_every_command_carries_an_example(run, path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    status, output, _ = run(*path, "--help")
    assert status == 0
    assert f"Example: {' '.join(('atg-fg', *path))}" in " ".join(output.split())
