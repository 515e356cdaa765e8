import json

import numpy as np
import pytest

pytest.importorskip("cv2", reason="OpenCV is not installed: pip install atg-fg[vision]")

from atg_fg.core.errors import AtgError, InvalidInputError
from atg_fg.senses.camera_calibration import Calibration
from atg_fg.storage.camera_files import CubeTags, read_calibration, read_tags, write_calibration, write_tags

CALIBRATION = Calibration(np.array([[600.5, 0, 320], [0, 601, 240], [0, 0, 1]]), np.arange(5) / 10, (640, 480), 0.3, 9)
TAGS = CubeTags("DICT_5X5_50", 0.039, tuple(range(12)), ((0, 1, 2, 3, 4, 5), (6, 7, 8, 9, 10, 11)))


def saved(tmp_path, document, **changed):
    path = tmp_path / "file.json"
    path.write_text(json.dumps({**document, **changed}))
    return path


def test_a_calibration_is_read_as_it_was_written(tmp_path):
    found = read_calibration(saved(tmp_path, write_calibration(CALIBRATION)))
    np.testing.assert_array_equal(found.intrinsics, CALIBRATION.intrinsics)
    np.testing.assert_array_equal(found.distortion, CALIBRATION.distortion)
    assert (found.image_size, found.error) == ((640, 480), 0.3)


def test_tags_are_read_as_they_were_written(tmp_path):
    assert read_tags(saved(tmp_path, write_tags(TAGS))) == TAGS


def test_a_symbol_is_the_place_of_its_id():
    tags = CubeTags("5X5_50", 0.039, (7, 3, 9)).seen_by(CALIBRATION)
    assert tags.symbols == {7: 0, 3: 1, 9: 2}
    assert tags.image_size == (640, 480)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"format": "atg-fg/memory"}, "format: 'atg-fg/memory'; expected 'atg-fg/camera'"),
        ({"image_size": [640]}, r"image_size: \[640\]; expected width and height"),
        ({"image_size": [640, 0]}, "image_size: 0; expected a whole number of at least 1"),
        ({"intrinsics": [[1, 2], [3, 4]]}, "expected a camera matrix of 3 by 3"),
        ({"intrinsics": [[1, "x", 2]] * 3}, "intrinsics: .* expected a camera matrix"),
        ({"distortion": [1]}, "distortion: 1 numbers; expected 4, 5"),
        ({"more": 1}, "unknown key 'more'"),
    ],
)
def test_a_calibration_that_is_none_is_refused_with_its_place(tmp_path, changed, message):
    path = saved(tmp_path, write_calibration(CALIBRATION), **changed)
    with pytest.raises(InvalidInputError, match=message) as error:
        read_calibration(path)
    assert str(path) in str(error.value)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"dictionary": "9X9_9"}, "dictionary of tags: unknown name '9X9_9'"),
        ({"dictionary": 5}, "dictionary: 5; expected a text"),
        ({"size_metres": 0}, "size of tags: 0.0; expected metres above 0"),
        ({"size_metres": "big"}, "size_metres: 'big'; expected a finite number"),
        ({"ids": [0, 1, 50], "cubes": []}, "tag ids: 50; expected 0 to 49"),
        ({"ids": [0, 1, 1], "cubes": []}, "tag ids: 0, 1, 1; expected all different"),
        ({"ids": [4], "cubes": []}, r"tag ids: \[4\]; expected at least two"),
        ({"ids": [0, -1]}, "ids: -1; expected a whole number"),
        ({"cubes": [[0, 1, 2, 3, 4]]}, r"cubes\[0\]: \[0, 1, 2, 3, 4\]; expected six different ids"),
        ({"cubes": [[0, 1, 2, 3, 4, 40]]}, r"cubes\[0\]: .*; expected six different ids of these tags"),
        ({"version": 2}, "version: 2; expected 1"),
    ],
)
def test_tags_that_cannot_be_are_refused(tmp_path, changed, message):
    path = saved(tmp_path, write_tags(TAGS), **changed)
    with pytest.raises(AtgError, match=message) as error:
        read_tags(path)
    assert str(path) in str(error.value)
