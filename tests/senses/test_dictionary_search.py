import numpy as np
import pytest

from atg_fg.senses.dictionary_search import find_dictionary
from atg_fg.senses.video import read_image
from tests.senses.images import sheet
from tests.senses.test_tags import PHOTOGRAPH


@pytest.mark.parametrize(
    ("dictionary", "ids"),
    [
        ("4X4_50", [3, 8, 20]),
        ("5X5_100", [3, 60]),
        ("6X6_250", [3, 101, 249]),
        ("7X7_1000", [999]),
        ("APRILTAG_36H11", [0, 500]),
        ("ARUCO_MIP_36H12", [17, 100]),
        ("ARUCO_ORIGINAL", [400, 1000]),
    ],
)
def test_the_smallest_dictionary_that_has_all_tags_is_found(dictionary, ids):
    assert find_dictionary(sheet(dictionary, ids)) == dictionary


def test_the_dictionary_of_a_photograph_is_found():
    assert find_dictionary(read_image(PHOTOGRAPH)) == "6X6_250"


def test_where_there_are_no_tags_there_is_no_dictionary():
    assert find_dictionary(np.full((60, 80, 3), 128, dtype=np.uint8)) is None
