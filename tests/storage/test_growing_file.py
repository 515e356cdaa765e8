"""Files that grow line by line."""

import gzip
import json

import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.storage.growing_file import GrowingFile, read_lines
from tests.work import lines_run

HEADER = {"format": "lines", "version": 1}


@pytest.fixture(params=[False, True], ids=["text", "packed"])
def packed(request):
    return request.param


@pytest.fixture
def file(tmp_path, packed):
    return GrowingFile(tmp_path / "lines", HEADER, "the lines", packed=packed)


def test_lines_come_back_in_their_order(file, tmp_path, packed):
    file.begin()
    lines = [{"text": "a\u2028b\x85c\r"}, {"number": 0.1}, {}]
    for line in lines:
        file.append(line)
    assert read_lines(file.path, packed=packed) == [HEADER, *lines]
    assert GrowingFile(file.path, HEADER, "the lines", packed=packed).resume() == lines


def test_a_line_that_was_cut_off_is_left_out_and_written_anew(file, packed):
    file.begin()
    file.append({"number": 1})
    sound = file.path.read_bytes()
    file.append({"number": 2})
    whole = file.path.read_bytes()
    for length in range(len(sound), len(whole)):
        file.path.write_bytes(whole[:length])
        again = GrowingFile(file.path, HEADER, "the lines", packed=packed)
        assert again.resume() == [{"number": 1}]
        assert file.path.read_bytes() == sound
        again.append({"number": 2})
        assert file.path.read_bytes() == whole


def test_two_writers_of_the_same_lines_do_no_harm(file, packed):
    file.begin()
    other = GrowingFile(file.path, HEADER, "the lines", packed=packed)
    assert other.resume() == []
    for number in range(3):
        file.append({"number": number})
    for number in range(3):
        other.append({"number": number})
    assert read_lines(file.path, packed=packed)[1:] == [{"number": number} for number in range(3)]


def test_lines_that_were_unpacked_and_packed_again_are_the_same_lines(tmp_path):
    file = GrowingFile(tmp_path / "lines", HEADER, "the lines", packed=True)
    file.begin()
    for number in range(3):
        file.append({"number": number})
    lines = read_lines(file.path, packed=True)
    file.path.write_bytes(gzip.compress(gzip.decompress(file.path.read_bytes())))
    assert read_lines(file.path, packed=True) == lines
    again = GrowingFile(file.path, HEADER, "the lines", packed=True)
    again.resume()
    again.append({"number": 3})
    assert read_lines(file.path, packed=True) == [*lines, {"number": 3}]


def test_another_file_is_refused_and_left_as_it_is(file, packed):
    file.begin()
    before = file.path.read_bytes()
    with pytest.raises(InvalidInputError, match="already there"):
        file.begin()
    other = GrowingFile(file.path, {"format": "others"}, "the others", packed=packed)
    with pytest.raises(InvalidInputError, match="expected the others"):
        other.resume()
    assert file.path.read_bytes() == before


def test_reading_takes_work_that_grows_as_the_lines_do(tmp_path, packed):
    took = []
    for number in (500, 4_000):
        path = tmp_path / f"{number}"
        line = json.dumps({"observed": [[1, 2]] * 10, "unseen": [0.5] * 10}).encode() + b"\n"
        path.write_bytes((gzip.compress(line, mtime=0) if packed else line) * number)
        lines, work = lines_run(read_lines, path, packed=packed)
        assert len(lines) == number
        took.append(work)
    assert took[1] < 8 * 2 * took[0]  # 64 times, if each line went over all of them
