from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.core.patterns import PatternAlphabet
from atg_fg.senses.tags import (
    DICTIONARIES,
    FALSE_ALARM,
    DetectedTag,
    TagDetector,
    TagPose,
    Tags,
    n_tags,
    tag_cells,
    tag_facing,
)
from atg_fg.senses.video import read_image
from tests.senses.images import FACING, INTRINSICS, seen, sheet, turned

PHOTOGRAPH = Path(__file__).parents[1] / "data" / "photographs" / "singlemarkersoriginal.jpg"
ALPHABET = PatternAlphabet(("front", "top"), 6)


def read(whiteness, tag_id=0, pose=None):
    """A tag as it was read, with a side of 70 pixels: 10 for each of the 7 cells of a 5×5 tag."""
    corners = np.array([[0.0, 0], [70, 0], [70, 70], [0, 70]])
    return DetectedTag(tag_id, tag_id, corners, 0, np.asarray(whiteness, dtype=float), pose)


def cells(tag_id):
    return tag_cells("5X5_50", tag_id)[1:-1, 1:-1]


@pytest.fixture
def detector():
    return TagDetector(Tags("5X5_50", 0.05, symbols={tag: tag for tag in range(6)}))


@pytest.mark.parametrize("dictionary", DICTIONARIES)
def test_the_tags_of_every_dictionary_are_found_and_read_without_an_error(dictionary):
    ids = [0, 1, n_tags(dictionary) // 2, n_tags(dictionary) - 1]
    found = TagDetector(Tags(dictionary, 0.05)).detect(sheet(dictionary, ids))
    assert sorted(tag.id for tag in found) == ids
    assert {tag.distance for tag in found} == {0}


def test_a_dictionary_is_named_as_opencv_names_it_or_shorter():
    assert Tags("DICT_6X6_250", 0.05).dictionary == Tags("6x6_250", 0.05).dictionary == "6X6_250"
    assert Tags("DICT_APRILTAG_36h11", 0.05).dictionary == "APRILTAG_36H11"


@pytest.mark.parametrize("distortion", [None, [-0.3, 0.1, 0.001, -0.002, 0.0]], ids=["ideal lens", "barrel"])
@pytest.mark.parametrize(
    ("rotation", "position"),
    [
        (FACING, [0.0, 0, 0.4]),
        (turned([1, 0, 0], -40) @ FACING, [0.03, 0.02, 0.4]),
        (turned([0, 1, 0], 35) @ turned([0, 0, 1], 20) @ FACING, [-0.04, 0.01, 0.35]),
    ],
    ids=["straight on", "leaning back", "turned and aslant"],
)
def test_the_pose_of_a_tag_is_measured_to_two_millimetres_across_two_percent_of_its_distance_and_three_degrees(
    rotation, position, distortion
):
    image = seen(
        "5X5_50", 7, rotation, np.array(position), distortion=None if distortion is None else np.array(distortion)
    )
    (tag,) = TagDetector(Tags("5X5_50", 0.05, INTRINSICS, distortion)).detect(image)
    assert tag.id == 7
    np.testing.assert_allclose(tag.behind(0)[:2], position[:2], atol=0.002)
    assert tag.behind(0)[2] == pytest.approx(position[2], rel=0.02)
    assert tag.normal @ rotation[:, 2] > np.cos(np.radians(3))
    assert tag.pose.corner_error < 0.5


def test_a_lens_that_is_left_out_of_account_turns_the_tag_and_puts_it_elsewhere():
    distortion = np.array([-0.3, 0.1, 0, 0, 0])
    position = np.array([0.12, 0.08, 0.4])
    image = seen("5X5_50", 7, FACING, position, distortion=distortion)
    known, unknown = (
        TagDetector(Tags("5X5_50", 0.05, INTRINSICS, lens)).detect(image)[0] for lens in (distortion, None)
    )
    error = [np.linalg.norm(tag.behind(0) - position) for tag in (known, unknown)]
    assert error[0] < 0.007 < 0.02 < error[1]
    degrees = [np.degrees(np.arccos(tag.normal @ FACING[:, 2])) for tag in (known, unknown)]
    assert degrees[0] < 1 < 8 < degrees[1]


def test_without_a_camera_matrix_a_tag_has_no_pose():
    (tag,) = TagDetector(Tags("5X5_50", 0.05)).detect(sheet("5X5_50", [3]))
    assert tag.pose is None
    with pytest.raises(InvalidInputError, match="tag 3: no pose; expected the intrinsics of the camera"):
        _ = tag.normal


def test_the_tags_of_a_photograph_are_read():
    image = read_image(PHOTOGRAPH)
    detector = TagDetector(Tags("DICT_6X6_250", 0.05, INTRINSICS))
    found = detector.detect(image)
    assert sorted(tag.id for tag in found) == [23, 40, 62, 98, 124, 203]
    assert {tag.distance for tag in found} == {0}
    assert min(detector.certainty(tag, 250) for tag in found) > 0.99
    # They lie on one table: the same way is up for all of them.
    normals = np.array([tag.normal for tag in found])
    assert (normals @ normals.mean(axis=0)).min() > np.cos(np.radians(8))


def test_an_image_without_tags_has_none():
    assert TagDetector(Tags("5X5_50", 0.05)).detect(np.full((100, 100, 3), 200, dtype=np.uint8)) == []


def test_an_id_stands_for_its_symbol_and_others_for_none():
    found = TagDetector(Tags("5X5_50", 0.05, symbols={9: 0, 4: 1})).detect(sheet("5X5_50", [4, 9, 17]))
    assert {tag.id: tag.symbol for tag in found} == {4: 1, 9: 0, 17: None}


def test_a_cell_painted_over_is_counted():
    image = sheet("5X5_50", [3], side=140)
    row, column = np.argwhere(cells(3) == 1)[0] + 1
    image[40 + 20 * row : 60 + 20 * row, 40 + 20 * column : 60 + 20 * column] = 0
    (tag,) = TagDetector(Tags("5X5_50", 0.05)).detect(image)
    assert (tag.id, tag.distance) == (3, 1)


def test_a_clean_reading_is_certain_but_for_a_false_alarm(detector):
    likelihood = detector.likelihood(read(cells(2), 2), 6)
    np.testing.assert_allclose(likelihood, np.where(np.arange(6) == 2, 1 - FALSE_ALARM, 0) + FALSE_ALARM / 6, atol=1e-9)
    assert detector.certainty(read(cells(2), 2), 6) == pytest.approx(1 - FALSE_ALARM * 5 / 6)


def test_grey_cells_say_nothing(detector):
    np.testing.assert_allclose(detector.likelihood(read(np.full((5, 5), 0.5)), 6), 1 / 6)


def test_each_cell_counts_by_the_probability_that_it_was_read_wrong(detector):
    # Tags 0 and 1, and what lies between them: of the cells in which they differ one more looks like tag 1.
    apart = np.argwhere(cells(0) != cells(1))
    between = cells(0).copy()
    for row, column in apart[: len(apart) // 2 + 1]:
        between[row, column] = cells(1)[row, column]
    more = 2 * (len(apart) // 2 + 1) - len(apart)
    two = TagDetector(Tags("5X5_50", 0.05, symbols={0: 0, 1: 1}))
    pose = TagPose(np.zeros(3), np.eye(3), corner_error=4.0)  # of a cell's 10 pixels: wrong = .005 + .5 · .4
    likelihood = two.likelihood(read(between, 0, pose), 2)
    odds = (0.795 / 0.205) ** more
    share = odds / (1 + odds)
    np.testing.assert_allclose(likelihood, [0.999 * (1 - share) + 0.0005, 0.999 * share + 0.0005], rtol=1e-9)


@given(st.integers(0, 5), st.lists(st.floats(0, 1), min_size=25, max_size=25), st.floats(0, 30))
def test_any_reading_gives_a_likelihood_that_can_be_learned_from(tag_id, whiteness, error):
    made = TagDetector(Tags("5X5_50", 0.05, symbols={tag: tag for tag in range(6)}))
    tag = read(np.reshape(whiteness, (5, 5)), tag_id, TagPose(np.zeros(3), np.eye(3), corner_error=error))
    likelihood = made.likelihood(tag, 6)
    assert likelihood.min() >= FALSE_ALARM / 6 * (1 - 1e-9)
    assert likelihood.sum() == pytest.approx(1)
    made.evidence(ALPHABET, {"front": tag}).check(len(ALPHABET))


def test_the_worse_the_corners_the_less_sure(detector):
    sure = [
        detector.likelihood(read(cells(2), 2, TagPose(np.zeros(3), np.eye(3), corner_error=error)), 6)[2]
        for error in (0, 5, 9, 10)
    ]
    assert sorted(sure, reverse=True) == sure
    assert sure[-1] == pytest.approx(1 / 6)  # off by a whole cell


def test_evidence_of_two_slots_is_the_product_and_knows_its_pattern(detector):
    evidence = detector.evidence(ALPHABET, {"front": read(cells(2), 2), "top": read(cells(5), 5)})
    assert evidence.pattern == ALPHABET.index((2, 5))
    assert evidence.detection == (2, 5)
    assert evidence.confidences == pytest.approx((1 - FALSE_ALARM * 5 / 6,) * 2)
    sure, other = 1 - FALSE_ALARM * 5 / 6, FALSE_ALARM / 6
    assert evidence.likelihood[ALPHABET.index((2, 5))] == pytest.approx(sure**2)
    assert evidence.likelihood[ALPHABET.index((2, 4))] == pytest.approx(sure * other)
    assert evidence.likelihood[ALPHABET.index((1, 4))] == pytest.approx(other**2)


def test_evidence_of_one_slot_leaves_the_other_open(detector):
    evidence = detector.evidence(ALPHABET, {"front": None, "top": read(cells(5), 5)})
    assert evidence.pattern is None
    assert len(set(evidence.likelihood[ALPHABET.symbols[:, 1] == 5].tolist())) == 1


def test_a_doubtful_reading_is_no_pattern_to_learn(detector):
    doubtful = read(np.full((5, 5), 0.5), 2)
    assert detector.evidence(ALPHABET, {"front": doubtful, "top": read(cells(5), 5)}).pattern is None


def test_a_tag_that_does_not_count_says_nothing(detector):
    stranger = DetectedTag(30, None, np.zeros((4, 2)), 0, cells(30).astype(float))
    assert detector.certainty(stranger, 6) == 0.0


def test_one_id_in_two_slots_is_refused(detector):
    with pytest.raises(InvalidInputError, match="tags: 2, 2 in view at once; expected no id twice"):
        detector.evidence(ALPHABET, {"front": read(cells(2), 2), "top": read(cells(2), 2)})


def test_the_tag_that_faces_a_direction_best_is_taken():
    up = np.array([0.0, 0, 1])
    tags = [read(cells(0), 0, TagPose(np.zeros(3), turned([1, 0, 0], degrees))) for degrees in (60, 30, 10)]
    assert tag_facing(tags, up) is tags[2]
    assert tag_facing(tags[:1], up) is None


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"size": 0}, "size of tags: 0; expected metres above 0"),
        ({"size": float("nan")}, "size of tags: nan; expected metres above 0"),
        ({"size": 1e-320}, "size of tags: 1e-320; expected metres above 0, from 0.0001 to 1000"),
        ({"size": 1e300}, r"size of tags: 1e\+300; expected metres above 0, from 0.0001 to 1000"),
        ({"symbols": {50: 0}}, "tag ids: 50; expected 0 to 49, those of 5X5_50"),
        ({"symbols": {1: 0, 2: 0}}, "expected another symbol for each id"),
        ({"intrinsics": np.eye(2)}, "expected a camera matrix of 3 by 3 numbers"),
        ({"intrinsics": -INTRINSICS}, "focal lengths above 0"),
        ({"intrinsics": "wide"}, "intrinsics: 'wide'; expected a camera matrix"),
        ({"distortion": [0.1, 0.2]}, "distortion: 2 numbers; expected 4, 5, 8, 12, 14"),
        ({"distortion": [np.inf] * 5}, "expected finite numbers"),
    ],
)
def test_what_makes_no_sense_is_refused_by_name_and_value(arguments, message):
    with pytest.raises(InvalidInputError, match=message):
        Tags(**{"dictionary": "5X5_50", "size": 0.05, **arguments})


def test_a_dictionary_that_is_none_is_refused_with_those_there_are():
    with pytest.raises(
        UnknownNameError, match=r"dictionary of tags: unknown name '3X3_50'; expected one of: .*6X6_250"
    ):
        Tags("3X3_50", 0.05)


def test_an_image_of_another_size_than_the_calibration_is_refused():
    detector = TagDetector(Tags("5X5_50", 0.05, INTRINSICS, image_size=(640, 480)))
    with pytest.raises(InvalidInputError, match="image: 320 by 240 pixels; expected 640 by 480, which the camera was"):
        detector.detect(np.zeros((240, 320, 3), dtype=np.uint8))


@pytest.mark.parametrize("image", [np.zeros((9, 9)), np.zeros((0, 9, 3), dtype=np.uint8), np.zeros(9, dtype=np.uint8)])
def test_what_is_no_image_is_refused(image):
    with pytest.raises(InvalidInputError, match=r"image: .* of shape .*; expected bytes of shape"):
        TagDetector(Tags("5X5_50", 0.05)).detect(image)
