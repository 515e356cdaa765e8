import json

import numpy as np
import pytest

cv2 = pytest.importorskip("cv2", reason="OpenCV is not installed: pip install atg-fg[vision]")

from tests.senses.images import sheet
from tests.senses.test_tags import PHOTOGRAPH


@pytest.fixture
def picture(tmp_path):
    """Write an image of some tags, and return its path."""

    def made(ids, name="tags.png", dictionary="5X5_50"):
        cv2.imwrite(str(tmp_path / name), sheet(dictionary, ids))
        return tmp_path / name

    return made


def test_the_photographs_ids_are_printed(run):
    status, output, _ = run("look", PHOTOGRAPH, "--dictionary", "DICT_6X6_250", "--json", "-")
    assert status == 0
    (image,) = json.loads(output)["images"]
    assert sorted(tag["id"] for tag in image["tags"]) == [23, 40, 62, 98, 124, 203]
    assert {tag["wrong_cells"] for tag in image["tags"]} == {0}
    assert image["dictionary"] == "6X6_250"


def test_the_dictionary_need_not_be_told(run, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    status, output, _ = run("look", PHOTOGRAPH)
    assert status == 0
    assert "6 tags of 6X6_250" in output
    for tag_id in (23, 40, 62, 98, 124, 203):
        assert f" {tag_id} " in output


def test_what_is_seen_is_drawn(run, picture, tmp_path):
    run("look", picture([1, 2]), "--draw", tmp_path / "seen")
    drawn = cv2.imread(str(tmp_path / "seen" / "tags.png"))
    before = cv2.imread(str(tmp_path / "tags.png"))
    assert drawn.shape == before.shape
    assert (drawn != before).any()


def test_an_image_without_tags_is_no_error(run, tmp_path):
    cv2.imwrite(str(tmp_path / "wall.png"), np.full((90, 90), 128, dtype=np.uint8))
    status, output, _ = run("look", tmp_path / "wall.png")
    assert status == 0
    assert output == f"{tmp_path / 'wall.png'}: no tags\n"


@pytest.fixture
def cube_file(run, tmp_path):
    run("print", "cube", "--tags", "0-5", "-o", tmp_path / "cube.pdf")
    return tmp_path / "cube.json"


def test_a_cube_is_read_by_its_file(run, picture, cube_file):
    _, output, _ = run("look", picture([3, 5, 9]), "--tags", cube_file, "--json", "-")
    (image,) = json.loads(output)["images"]
    assert {tag["id"]: tag["symbol"] for tag in image["tags"]} == {3: 3, 5: 5, 9: None}


def test_two_tags_of_one_id_and_a_cube_of_other_tags_are_refused(refused, picture, cube_file):
    assert "tag 3 is in view twice; expected each tag once" in refused("look", picture([3, 3]), "--tags", cube_file)
    line = refused("look", picture([20, 21]), "--tags", cube_file)
    assert "tags.png: tags 20, 21; expected some of the tags in" in line


def test_bad_input_is_one_line(refused, picture, tmp_path, cube_file):
    (tmp_path / "text.png").write_text("no image")
    assert "nowhere.png: no such file; expected an image" in refused("look", "nowhere.png")
    assert "text.png: cannot be read; expected an image" in refused("look", tmp_path / "text.png")
    good = picture([1])
    assert "unknown name '8X8_50'; expected one of" in refused("look", good, "--dictionary", "8X8_50")
    assert "size of tags: 0.0" in refused("look", good, "--dictionary", "5X5_50", "--tag-size", "0")
    assert "expected none with --tags" in refused("look", good, "--tags", cube_file, "--dictionary", "5X5_50")
    assert "expected degrees between 0 and 180" in refused("look", good, "--field-of-view", "190")
    camera = tmp_path / "camera.json"
    lens = {"intrinsics": [[600, 0, 320], [0, 600, 240], [0, 0, 1]], "distortion": [0, 0, 0, 0, 0]}
    camera.write_text(json.dumps({"format": "atg-fg/camera", "version": 1, "image_size": [640, 480], **lens}))
    assert f"expected 640 by 480, which {camera} was made for" in refused("look", good, "--calibration", camera)
