"""Pictures beside a record: of each look, and the crops that stand for symbols."""

import base64
import gzip
import json
import struct

import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.records import StepSummary
from atg_fg.experiments.table1 import TestPlan, run_test
from atg_fg.report.pictures import thumbnails
from atg_fg.report.reading import read_report
from tests.report.test_reading import changed


def test_pictures_come_from_the_records_folder_alone(record, tmp_path):
    secret = tmp_path.parent / f"{tmp_path.name}.png"
    secret.write_bytes(b"\x89PNG\r\n\x1a\n")
    (tmp_path / "text.png").write_text("no picture")
    (tmp_path / "link.png").symlink_to(secret)
    for frame in (f"../{secret.name}", str(secret), "text.png", "link.png", "absent.png", 7, "", "a\0b"):
        changed(record, lambda lines, frame=frame: lines[1].update(frame=frame))
        with pytest.raises(InvalidInputError, match=r"line 2: frame: .* (expected|cannot be read)"):
            read_report(record)
    (tmp_path / "good.png").write_bytes(b"\x89PNG\r\n\x1a\nrest")
    changed(record, lambda lines: lines[1].update(frame="good.png"))
    assert read_report(record).trials[0].looks[0].frame == "data:image/png;base64,iVBORw0KGgpyZXN0"


def png(side, size=100):
    """The beginning of a PNG of so many pixels a side, filled up to a size."""
    return (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + struct.pack(">II", side, side)).ljust(size, b"\0")


def test_the_crop_that_shows_a_symbol_most_surely_stands_for_it(record, tmp_path):
    for name in "abc":
        (tmp_path / f"{name}.png").write_bytes(png(48) + name.encode())

    looks = (([3, None], ["a.png", None], [0.5, None]), ([4, 3], ["b.png", "c.png"], [0.9, 0.9]))

    def change(lines):
        for line, (observed, crops, sure) in zip(lines[1:], looks, strict=False):
            line.update(observed=observed, crops=crops, truth={**line["truth"], "confidences": sure})

    changed(record, change)
    (page,) = read_report(record).trials
    assert page.thumbnails == {
        symbol: "data:image/png;base64," + base64.b64encode(png(48) + name).decode()
        for symbol, name in ((3, b"c"), (4, b"b"))
    }


def test_a_page_takes_so_many_crops_of_a_test(tmp_path, monkeypatch):
    run_test(TestPlan(engine="bayes-filter", n_trials=3, n_actions=2, n_objects=4), 3, tmp_path)
    log, crop = tmp_path / "test-0003.jsonl.gz", tmp_path / "a.png"
    crop.write_bytes(png(48))
    header, *trials = map(json.loads, gzip.decompress(log.read_bytes()).splitlines())
    for trial in trials:
        trial["crops"] = [["a.png", None] for _ in trial["observed"]]
    log.write_bytes(gzip.compress("".join(json.dumps(line) + "\n" for line in (header, *trials)).encode()))
    report = read_report(log)
    assert all(page.thumbnails for page in report.trials)
    assert report.notes == ()
    room = sum(map(len, report.trials[0].thumbnails.values()))
    monkeypatch.setattr("atg_fg.report.test_log.MOST_CROPS", room)
    report = read_report(log)
    assert [bool(page.thumbnails) for page in report.trials] == [True, False, False]
    assert report.notes == ("There are more crops than a page takes: later trials are shown with numbers of symbols.",)
    crop.unlink()
    with pytest.raises(InvalidInputError, match=r"trial 0: look [0-2]: crops\[0\]: 'a.png' is no file"):
        read_report(log)


def test_a_trial_with_more_crops_than_a_page_takes_is_shown_with_numbers(tmp_path):
    for name in "ab":
        (tmp_path / f"{name}.png").write_bytes(png(48))
    looks = [
        ("here", StepSummary((3, 4), None, 0.5, 0.1, {}, crops=("a.png", "b.png"))),
        ("there", StepSummary((5, None), None, 0.5, 0.1, {}, crops=(None, None))),
    ]
    whole = thumbnails(looks, tmp_path)
    assert list(whole) == [3, 4]
    room = sum(map(len, whole.values()))
    assert thumbnails(looks, tmp_path, room) == whole
    assert thumbnails(looks, tmp_path, room - 1) == {}


@pytest.mark.parametrize(
    ("crops", "message"),
    [
        ("a.png", "crops: 'a.png'; expected a list"),
        (["good.png"], "crops: 1 entries; expected 2"),
        (["good.png", "../good.png"], r"crops\[1\]: '../good.png'; expected a path inside"),
        (["large.png", None], r"crops\[0\]: 'large.png'; expected a PNG of at most 256 pixels a side"),
        (["none.png", None], r"crops\[0\]: 'none.png'; expected a PNG of at most 256 pixels a side"),
        (["photo.jpg", None], r"crops\[0\]: 'photo.jpg'; expected a PNG of at most"),
        (["heavy.png", None], r"crops\[0\]: 'heavy.png'; expected a PNG or JPEG picture of at most 200,000 bytes"),
        ([7, None], r"crops\[0\]: 7; expected a text"),
    ],
)
def test_a_crop_that_is_no_small_picture_is_refused(record, tmp_path, crops, message):
    pictures = {"good": png(48), "large": png(257), "none": png(0), "heavy": png(48, 200_001)}
    for name, content in pictures.items():
        (tmp_path / f"{name}.png").write_bytes(content)
    (tmp_path / "photo.jpg").write_bytes(b"\xff\xd8\xff")
    changed(record, lambda lines: lines[1].update(crops=crops))
    with pytest.raises(InvalidInputError, match=f"line 2: {message}"):
        read_report(record)


@pytest.mark.parametrize("stated", [7, "sure", [1.0], [2.0, None], ["a", None], {"front": 1.0}])
def test_confidences_beside_crops_are_checked(record, tmp_path, stated):
    (tmp_path / "good.png").write_bytes(png(48))
    changed(record, lambda lines: lines[1].update(crops=["good.png", None], truth={"confidences": stated}))
    with pytest.raises(InvalidInputError, match="line 2: truth: confidences"):
        read_report(record)
