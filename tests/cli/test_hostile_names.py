"""Names from a file are shown as they are by every command, and steer no terminal, no figure and no markup."""

import json
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
from hypothesis import given
from hypothesis import strategies as st

from atg_fg import cli
from atg_fg.core.visible_text import visible
from atg_fg.storage import memory_files, memory_json, packaged
from sim import cli as sim_cli
from tests.storage.database.small import plain

#: What rich, matplotlib, a terminal, Markdown, XML or DOT would take for something else than a name.
HOSTILE = (
    "[/bold]",
    "cup [big]",
    "[link=https://example.org]here[/link]",
    ":smile:",
    "\x1b[31mred\x1b[0m",
    "\x1b]0;title\x07",
    "bell\x07 and \x9b2J",
    "\u202elive",
    "two\nlines",
    "two\rlines\u2028more",
    "\x00\x7f",
    "$\\frac{1}{$",
    '<b>"50%" & | `more`',
    "\\x1b",
)
#: All of them in one name stand for each by itself.
EACH_NAME = pytest.mark.parametrize(
    "name", [" ".join(HOSTILE), *(pytest.param(name, marks=pytest.mark.slow) for name in HOSTILE)]
)
STEERING = re.compile("[\0-\x09\x0b-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069]")


def renamed(memory, *old_and_new):
    """Return a memory as JSON in which names have been replaced."""
    text = memory_json.memory_to_json(memory)
    for old, new in old_and_new:
        assert json.dumps(old) in text
        text = text.replace(json.dumps(old), json.dumps(new))
    return text


def script(tmp_path, name):
    """Write a scripted trial whose object, action and slot have a name; return its path."""
    document = {
        "format": "atg-fg/scripted-trial",
        "version": 1,
        "assumptions": {"n_objects": 100, "n_aspects": 24, "actions": [name], "slots": [name, "top"], "n_symbols": 12},
        "parameters": {"transition_concentration": 1e-6, "observation_noise": 1e-6, "learn_in_trial": False},
        "memory": [
            {
                "name": name,
                "aspects": [[0, 1], [1, 5]],
                "transitions": [{"from": 0, "action": name, "to": 1, "count": 1}],
            }
        ],
        "steps": [{"observe": [0, 1]}, {"act": name}, {"observe": [1, None]}],
    }
    (tmp_path / "script.json").write_text(json.dumps(document))
    return tmp_path / "script.json"


@pytest.fixture
def shown(run, monkeypatch):
    """Run a command on a wide terminal; check that what it prints steers nothing, and return it."""
    monkeypatch.setenv("COLUMNS", "400")

    def called(*words, status=0):
        left, output, error = run(*words)
        assert left == status, error
        assert not STEERING.search(output + error)
        return output + error

    return called


@EACH_NAME
def test_every_command_shows_a_name_of_an_object_as_it_is(shown, tmp_path, name):
    file, other = tmp_path / "memory.json", tmp_path / "other.json"
    file.write_text(renamed(plain(2), ("object-001", name)))
    other.write_text(renamed(plain(2), ("object-001", f"{name}!")))
    seen = visible(name)
    lines = visible(name, keep="\n").split("\n")  # in the cell of a table
    assert all(line in shown("memory", "show", file) for line in lines)
    assert seen in shown("memory", "diff", file, other, status=1)
    shown("memory", "merge", file, other, "-o", tmp_path / "union.json")
    assert "unknown name" in shown("memory", "unmerge", file, name, status=2)
    shown("memory", "duplicates", file)
    trial = ("--actions", "1", "--engine", "bayes-filter", "--memory", file)
    assert all(line in shown("trial", *trial) for line in lines)
    for kind in ("graphml", "dot"):
        exported = tmp_path / f"atg.{kind}"
        shown("memory", "export", file, "--name", name, "--format", kind, "--output", exported)
        if kind == "graphml":
            ElementTree.fromstring(exported.read_bytes())


@EACH_NAME
def test_every_command_shows_names_in_a_script_as_they_are(shown, tmp_path, name):
    file = script(tmp_path, name)
    for words in (("replay", file, "--table"), ("explain", file, "--smooth", "--samples", "2")):
        assert all(line in shown(*words) for line in visible(name, keep="\n").split("\n"))
    shown("uai", "export", file, "--model", tmp_path / "model", "--evidence", tmp_path / "evidence")


@pytest.mark.parametrize(
    "name",
    [
        pytest.param("[/b]:smile:$\\frac{1}{$", marks=pytest.mark.slow),
        "\x1b[31mred\x9b2J\u202elive\x00",
        pytest.param('two\nlines<b>"&|', marks=pytest.mark.slow),
    ],
)
def test_structures_are_told_and_drawn_with_any_names(shown, tmp_path, name):
    file = tmp_path / "memory.json"
    memory = memory_json.memory_from_json(packaged.example_memory(), "example")
    names = (memory.names[0], name), (memory.assumptions.actions[0], f"{name}+"), ("top", f"{name}-")
    file.write_text(renamed(memory, *names))
    output = shown("memory", "structure", file, "--plot", tmp_path / "structure.png")
    assert all(line in output for line in visible(name, keep="\n").split("\n"))
    drawn = tmp_path / "completed.svg"
    shown("memory", "structure", file, "--object", name, "--plot", drawn)
    ElementTree.fromstring(drawn.read_bytes())


@pytest.mark.parametrize("name", [name for name in HOSTILE if "\0" not in name and "//" not in name])
def test_errors_show_what_was_given_as_it_is(shown, name):
    assert visible(" ".join(name.split())) in shown("memory", "show", f"folder {name}", status=2)


@pytest.mark.parametrize("option", ["--actions", "--settled", "--nonsense"])
def test_an_error_does_not_repeat_all_of_a_long_word(shown, option):
    assert len(shown("trial", option, "9" * 100_000, status=2)) < 2500


def test_there_is_one_way_to_the_terminal():
    sources = [*Path(cli.__file__).parent.glob("*.py"), Path(sim_cli.__file__)]
    for source in sources:
        if source.name != "terminal.py":
            assert not re.search(r"typer\.echo\(|[^\w]Console\(", source.read_text()), source


def test_names_are_kept_as_they_are_in_files(run, tmp_path):
    memory = memory_json.memory_from_json(renamed(plain(2), ("object-001", "\x1b[31m")))
    for path in ("memory.json", "memory.db", "memory.npz"):
        memory_files.save_memory(memory, tmp_path / path)
        assert memory_files.load_memory(tmp_path / path).names[1] == "\x1b[31m"


@given(st.text())
def test_what_is_visible_is_one_line_and_can_be_written_in_utf_8(text):
    shown = visible(text)
    assert "\n" not in shown
    shown.encode()
    assert visible(shown) == shown
    assert not STEERING.search(shown)
