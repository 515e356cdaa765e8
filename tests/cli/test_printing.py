import json

import pytest

pytest.importorskip("cv2", reason="OpenCV is not installed: pip install atg-fg[vision]")
pytest.importorskip("matplotlib")

from atg_fg.storage.camera_files import read_tags


def test_cubes_are_printed_with_the_file_of_their_tags(run, tmp_path):
    output = tmp_path / "cubes.pdf"
    status, printed, _ = run("print", "cube", "--tags", "0-11", "--cubes", "3", "-o", output)
    assert status == 0
    assert output.read_bytes().startswith(b"%PDF")
    tags = read_tags(tmp_path / "cubes.json")
    assert tags.ids == tuple(range(12))
    assert len(tags.cubes) == 3
    assert tags.size == pytest.approx(0.042)
    assert "told apart after 0.00 actions on average" in printed
    for cube in tags.cubes:
        assert f"tags {' '.join(map(str, cube))}" in printed


def test_solids_are_written_by_the_suffix(run, tmp_path):
    pytest.importorskip("manifold3d")
    assert run("print", "cube", "--tags", "0-5", "-o", tmp_path / "cube.3mf")[0] == 0
    assert (tmp_path / "cube.3mf").read_bytes().startswith(b"PK")
    assert run("print", "cube", "--tags", "0-5", "-o", tmp_path / "cube.stl")[0] == 0


def test_the_result_as_json(run, tmp_path):
    _, output, _ = run("print", "cube", "--tags", "3,5-9", "-o", tmp_path / "c.pdf", "--json", "-")
    document = json.loads(output)
    assert document["tags"]["ids"] == [3, 5, 6, 7, 8, 9]
    assert document["expected_actions"] == 0.0


def test_a_board_is_printed(run, tmp_path):
    assert run("print", "board", "-o", tmp_path / "board.pdf")[0] == 0
    assert (tmp_path / "board.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--tags", "0-4"], "5 different ones; expected at least six"),
        (["--tags", "0-60"], "--tags: 50; expected 0 to 49, those of 5X5_50"),
        (["--tags", "a-b"], "--tags: 'a-b'; expected whole numbers and ranges"),
        (["--tags", "9-1"], "expected a range from low to high"),
        (["--tags", "0-99999999"], "of at most 10000"),
        (["--tags", "1,1,2,3,4,5"], "expected all different"),
        (["--dictionary", "nope"], "dictionary of tags: unknown name 'nope'"),
        (["--cubes", "0"], "'--cubes': Input should be greater than or equal to"),
        (["--cubes", "31", "--tags", "0-5"], "expected at most 30"),
        (["--side", "400"], "cube of 400 mm; expected at most 194 mm on a4"),
        (["--side", "nan"], "--side: nan; expected 1 to 2000 mm"),
        (["--tag-size", "50"], "expected at most 43.6 mm"),
        (["--paper", "b7"], "paper: unknown name 'b7'"),
        (["-o", "cube.doc"], "suffix '.doc'; expected .pdf, .3mf or .stl"),
        (["-o", "nowhere/cube.pdf"], "nowhere/cube.pdf: cannot be written"),
    ],
)
def test_bad_input_is_one_line_and_writes_nothing(refused, tmp_path, monkeypatch, arguments, message):
    monkeypatch.chdir(tmp_path)
    assert message in refused("print", "cube", *arguments)
    assert list(tmp_path.iterdir()) == []


def test_what_stands_where_the_tags_would_be_written_is_spared(refused, run, tmp_path):
    tags = tmp_path / "cube.json"
    tags.write_text('{"mine": 1}')
    assert "cube.json: holds something else" in refused("print", "cube", "-o", tmp_path / "cube.pdf")
    assert (tags.read_text(), [path.name for path in tmp_path.iterdir()]) == ('{"mine": 1}', ["cube.json"])
    tags.unlink()
    for _ in range(2):  # tags of cubes may take the place of others, as their sheet does
        run("print", "cube", "-o", tmp_path / "cube.pdf")
