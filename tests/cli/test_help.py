"""Help of the command line: each command says what it does and gives an example."""

import re
import subprocess
import sys

import pytest
import typer

from atg_fg import cli
from atg_fg.cli.lazy_commands import LazyCommand


def commands(command, path=()):
    """All commands, as the words that call them; groups too."""
    yield path
    for name, below in getattr(command, "commands", {}).items():
        yield from commands(below.load() if isinstance(below, LazyCommand) else below, (*path, name))


@pytest.mark.parametrize("path", list(commands(typer.main.get_command(cli.app))), ids=" ".join)
def test_help_of_every_command_carries_an_example(run, path, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    status, output, _ = run(*path, "--help")
    assert status == 0
    assert f"Example: {' '.join(('atg-fg', *path))}" in " ".join(output.split())


def test_the_list_of_commands_tells_what_each_says_of_itself_and_imports_none(run):
    group = typer.main.get_command(cli.app)
    for command in group.commands.values():
        command.read_help()
        assert command.help == command.load().help
    code = "import sys\nfrom atg_fg.cli import main\ntry:\n main()\nexcept SystemExit:\n print(*sys.modules)"
    process = subprocess.run([sys.executable, "-c", code, "--help"], capture_output=True, text=True, check=True)
    loaded = set(process.stdout.splitlines()[-1].split())
    assert {name for name in loaded if name.startswith("atg_fg.cli.")} == {"atg_fg.cli.lazy_commands"}
    assert not loaded & {"gtsam", "networkx", "matplotlib", "sqlite3", "atg_fg.engines", "sim.cli", "benchmarks.cli"}
    for command in group.commands.values():
        assert command.name in process.stdout


def test_a_command_whose_source_is_out_of_reach_is_imported_for_its_help(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "offered.py").write_text(
        "def _make():\n    def count() -> None:\n        'Count.'\n    return count\ncount = _make()"
    )
    command = LazyCommand("count", "offered:count")
    command.read_help()
    assert command.help == "Count."


@pytest.mark.parametrize("words", [("compare", "--trials", "1"), ("calibrate",), ("structure", "show", "m.json")])
def test_a_command_of_an_earlier_version_says_what_it_is_called_now(refused, words):
    assert f"{words[0]}: this command has another name now; expected atg-fg {cli.MOVED[words[0]]}" in refused(*words)


def test_commands_and_long_lists_of_options_stand_in_panels(run, monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    listed = run("--help")[1]
    for panel in ("Try it", "Your data", "Memory", "Experiments", "Engines", "Simulation"):
        assert f" {panel} ─" in listed
    assert not set(cli.MOVED) & set(re.findall(r"^│ (\w+)", listed, re.MULTILINE))
    for command in ("table1", "goal"):
        page = run(command, "--help")[1]
        for panel in ("World", "Model", "Trials", "Running"):
            assert f" {panel} ─" in page
