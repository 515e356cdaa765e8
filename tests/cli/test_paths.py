"""No command writes over a file that it reads: every pair of paths of every command, by every kind of link."""

import os
from itertools import combinations

import pytest
import typer

from atg_fg.cli import app
from atg_fg.cli.paths import IN_PLACE, parameters_of

#: What each command writes to.
OUTPUTS = {
    "learn": {"memory", "json_file"},
    "recognise": {"memory", "report", "json_file"},
    "recordings check": {"json_file"},
    "recordings convert": {"output"},
    "recordings export": set(),
    "recordings simulate": {"output"},
    "ablation": {"json_file", "log", "plot"},
    "bench": {"json_file", "markdown"},
    "camera calibrate": {"json_file", "output"},
    "demo": {"json_file", "output"},
    "doctor": {"json_file"},
    "engines check": {"json_file"},
    "engines compare": {"json_file", "plot"},
    "explain": {"json_file"},
    "figure3": {"json_file", "log", "csv_file", "plot"},
    "goal": {"json_file", "records", "video"},
    "live": {"json_file", "memory", "draw"},
    "look": {"json_file", "draw"},
    "memory check": {"json_file"},
    "memory compact": {"json_file", "output"},
    "memory diff": {"json_file"},
    "memory duplicates": {"json_file"},
    "memory example": {"output"},
    "memory export": {"output"},
    "memory import": {"into"},
    "memory merge": {"json_file", "output"},
    "memory repair": {"json_file"},
    "memory show": {"json_file"},
    "memory structure": {"json_file", "plot"},
    "memory unmerge": set(),
    "memory rename": set(),
    "print board": {"output"},
    "print cube": {"json_file", "output"},
    "replay": set(),
    "report": {"output"},
    "rescore": {"json_file"},
    "sim calibrate": {"json_file", "output"},
    "sim picture": {"output", "film", "table"},
    "sim reliability": {"json_file"},
    "sim webcam": {"output", "calibration"},
    "table1": {"json_file", "records", "save_memories"},
    "trial": {"json_file", "record", "save_memory"},
    "uai export": {"model", "evidence"},
    "uai solve": {"json_file"},
    "watch": {"save"},
}


#: Folders, and files whose name or content a command looks at first.
CHECKED_OTHERWISE = {
    *(("learn", "memory"), ("recognise", "memory"), ("recognise", "report"), ("bench", "markdown"), ("demo", "output")),
    *(("goal", "records"), ("goal", "video"), ("live", "memory"), ("live", "draw"), ("look", "draw")),
    *(
        ("memory compact", "output"),
        ("memory example", "output"),
        ("memory export", "output"),
        ("memory import", "into"),
    ),
    *(("print board", "output"), ("print cube", "output"), ("table1", "records"), ("table1", "save_memories")),
    *(("sim picture", "output"), ("sim picture", "film"), ("sim picture", "table"), ("watch", "save")),
}


def commands(group, name=()):
    for word, command in group.commands.items():
        loaded = command.load() if hasattr(command, "load") else command
        if hasattr(loaded, "commands"):
            yield from commands(loaded, (*name, word))
        else:
            yield " ".join((*name, word)), loaded


COMMANDS = dict(commands(typer.main.get_command(app)))
PATHS = {name: parameters_of(command.callback) for name, command in COMMANDS.items()}
PAIRS = [
    (name, one.name, other.name)
    for name, paths in PATHS.items()
    for one, other in combinations(paths, 2)
    if (one.written or other.written) and {one.name, other.name} not in IN_PLACE
]


def arguments(name, **paths):
    """Return a command line that gives these paths, and something of its own for all else that must be given."""
    words = name.split()
    for parameter in COMMANDS[name].params:
        given = paths.get(parameter.name)
        if given is None and parameter.required:
            given = "MAR" if parameter.name == "task" else f"some-{parameter.name}"
        if given is not None:
            words += [str(given)] if parameter.param_type_name == "argument" else [parameter.opts[0], str(given)]
    return words


def hard_link(there, folder):
    os.link(there, folder / "hard.json")
    return folder / "hard.json"


def soft_link(there, folder):
    (folder / "far").mkdir()
    (folder / "far" / "soft.json").symlink_to(there)
    return folder / "far" / "soft.json"


def dangling_link(there, folder):
    there.unlink()
    return soft_link(there, folder)


SAME = {
    "itself": lambda there, _: there,
    "another spelling": lambda there, folder: folder / ".." / folder.name / "." / there.name,
    "a link": soft_link,
    "a hard link": hard_link,
    "a link to a file yet to be made": dangling_link,
}


def test_the_paths_that_a_command_writes_to_are_declared_as_such():
    assert {name: {path.name for path in paths if path.written} for name, paths in PATHS.items()} == OUTPUTS


@pytest.mark.parametrize(
    ("name", "option"),
    [
        (name, path.name)
        for name, paths in PATHS.items()
        for path in paths
        if path.written and (name, path.name) not in CHECKED_OTHERWISE
    ],
)
def test_a_result_that_cannot_be_written_is_refused_before_any_work(tmp_path, refused, name, option):
    there = tmp_path / "nowhere" / "result.png"
    assert f"{there}: cannot be written" in refused(*arguments(name, **{option: there}))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("pair", "same"),
    [(pair, "itself") for pair in PAIRS]
    # How a path leads to a file is looked at in one place for all pairs.
    + [(pair, same) for pair in PAIRS[::10] for same in SAME if same != "itself"],
    ids=str,
)
def test_one_file_for_two_paths_of_a_command_is_refused_and_stays_as_it_was(tmp_path, refused, pair, same):
    name, one, other = pair
    there = tmp_path / "there.json"
    there.write_bytes(b"precious")
    error = refused(*arguments(name, **{one: there, other: SAME[same](there, tmp_path)}))
    assert "and would be overwritten; expected another file" in error
    assert not there.exists() or there.read_bytes() == b"precious"
    assert sorted(path.name for path in tmp_path.iterdir()) in (
        ["there.json"],
        ["far", "there.json"],
        ["hard.json", "there.json"],
        ["far"],
    )


def test_the_file_beside_what_is_printed_is_no_place_for_another_result(tmp_path, refused):
    error = refused("print", "cube", "-o", tmp_path / "cube.pdf", "--json", tmp_path / "cube.json")
    assert "would be overwritten" in error


def test_drawings_overwrite_neither_images_nor_each_other(tmp_path, refused):
    (tmp_path / "a").mkdir()
    for image in (tmp_path / "one.png", tmp_path / "a" / "one.png"):
        image.write_bytes(b"precious")
    assert "overwrite" in refused("look", tmp_path / "one.png", "--draw", tmp_path)
    drawn = refused("look", tmp_path / "one.png", tmp_path / "a" / "one.png", "--draw", tmp_path / "drawn")
    assert "overwrite" in drawn
    assert (tmp_path / "one.png").read_bytes() == b"precious"


@pytest.mark.parametrize("end", ["-wal", "-shm", "-journal"])
def test_what_sqlite_keeps_beside_a_database_is_a_part_of_it(tmp_path, refused, end):
    assert "would be overwritten" in refused(
        "memory", "show", tmp_path / "robot.db", "--json", tmp_path / f"robot.db{end}"
    )


@pytest.mark.parametrize("name", ["test-0000.jsonl.gz", "run-0003.json.gz", "look-012.png", "memory.json"])
def test_what_a_command_makes_in_a_folder_is_no_place_for_another_result(tmp_path, refused, name):
    error = refused("goal", "--records", tmp_path, "--json", tmp_path / name)
    assert "would be overwritten" in error


def test_two_outputs_may_go_to_a_device_and_a_result_beside_the_records(tmp_path, run):
    words = ("figure3", "--actions", "1", "--tests", "1", "--trials", "1", "--jobs", "1")
    assert run(*words, "--json", "/dev/null", "--csv", "/dev/null")[0] == 0
    words = ("table1", "--actions", "1", "--tests", "1", "--trials", "1", "--jobs", "1", "--engine", "bayes-filter")
    assert run(*words, "--records", tmp_path, "--json", tmp_path / "table1.json")[0] == 0
    assert (tmp_path / "table1.json").exists()
