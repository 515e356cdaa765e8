import os
import struct
import time
import zlib

import cv2
import numpy as np
import pytest

from atg_fg.core.errors import CameraError, InvalidInputError
from atg_fg.senses import frame_reader
from atg_fg.senses.video import FrameSource, read_image


@pytest.fixture
def video(tmp_path):
    """Twenty frames, each ten levels brighter in red, at ten a second."""
    path = tmp_path / "red.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*"MJPG"), 10, (64, 48))
    for number in range(20):
        image = np.zeros((48, 64, 3), dtype=np.uint8)
        image[:, :, 2] = 10 * number
        writer.write(image)
    writer.release()
    return path


def test_a_video_gives_every_frame_with_its_time_in_rgb(video):
    with FrameSource("video", video) as frames:
        found = list(frames)
    assert [frame.time for frame in found] == pytest.approx([number / 10 for number in range(20)])
    red, green, blue = found[15].image.reshape(-1, 3).mean(axis=0)
    assert red == pytest.approx(150, abs=4)
    assert max(green, blue) < 6


def test_a_folder_of_images_is_read_in_the_order_of_names(tmp_path):
    for name, level in (("b.png", 20), ("a.png", 10), ("c.JPG", 30)):
        cv2.imwrite(str(tmp_path / name), np.full((8, 8), level, dtype=np.uint8))
    (tmp_path / "notes.txt").write_text("no image")
    with FrameSource("images", tmp_path) as frames:
        assert [(frame.time, frame.image[0, 0, 0]) for frame in frames] == [(0, 10), (1, 20), (2, 30)]


def test_reading_may_end_before_the_frames_do(video):
    with FrameSource("video", video) as frames:
        next(iter(frames))
    assert frames._process.poll() is not None
    assert not frames._thread.is_alive()


def test_a_camera_that_hangs_is_given_up_in_time(tmp_path, monkeypatch):
    hangs = tmp_path / "hangs.py"
    hangs.write_text("import time\ntime.sleep(60)\n")
    monkeypatch.setattr(frame_reader, "__file__", str(hangs))
    begun = time.monotonic()
    with (
        FrameSource("camera", 0, timeout=0.5) as frames,
        pytest.raises(CameraError, match=r"camera 0: no frame within 0.5 s; expected one, or a longer time-out"),
    ):
        next(iter(frames))
    assert time.monotonic() - begun < 10
    assert frames._process.poll() is not None


def test_a_reader_that_breaks_down_is_an_error_and_no_end(tmp_path, monkeypatch):
    dies = tmp_path / "dies.py"
    dies.write_text("import os\nos.abort()\n")
    monkeypatch.setattr(frame_reader, "__file__", str(dies))
    with FrameSource("camera", 0) as frames, pytest.raises(CameraError, match="the reader of frames has broken down"):
        next(iter(frames))


def test_a_camera_gives_its_last_frame_and_leaves_out_those_nobody_took(tmp_path, monkeypatch):
    quick = tmp_path / "quick.py"
    quick.write_text(
        "import struct, sys, time\nheader = struct.Struct('<iiiid')\nnumber = 0\n"
        "while True:\n"
        "    sys.stdout.buffer.write(header.pack(0, 1, 1, 3, number) + bytes(3))\n    sys.stdout.buffer.flush()\n"
        "    number += 1\n    time.sleep(0.001)\n"
    )
    monkeypatch.setattr(frame_reader, "__file__", str(quick))
    with FrameSource("camera", 0) as frames:
        reading = iter(frames)
        first = next(reading).time
        time.sleep(1)
        assert next(reading).time > first + 20


@pytest.mark.parametrize(
    ("source", "name", "message"),
    [
        ("camera", "front", "camera: 'front'; expected its number, 0 for the first one"),
        ("camera", "-1", "camera: '-1'; expected its number"),
        ("video", "nowhere.mp4", "nowhere.mp4: no such file; expected a video"),
        ("images", "nowhere", "nowhere: no such file; expected an image, or a folder of images"),
        ("camera", "9" * 20, "expected its number, 0 for the first one, at most 99"),
        ("camera", "²", "camera: '²'; expected its number"),
        ("video", "/", "/: a folder; expected a video"),
        ("video", os.devnull, "no plain file; expected a video"),
        ("images", os.devnull, "no plain file; expected an image, or a folder of images"),
    ],
)
def test_a_name_that_cannot_be_is_refused_at_once(source, name, message):
    with pytest.raises(InvalidInputError, match=message):
        FrameSource(source, name)


@pytest.mark.parametrize("timeout", [0, -1, 1e308, float("inf"), float("nan")])
def test_a_time_out_that_is_none_is_refused(timeout):
    with pytest.raises(InvalidInputError, match=r"time-out of a camera: .*; expected seconds above 0"):
        FrameSource("camera", 0, timeout)


def test_a_camera_that_is_not_there_is_one_line():
    with FrameSource("camera", 63) as frames, pytest.raises(CameraError, match="camera 63: no such camera"):
        next(iter(frames))


def test_a_video_without_frames_and_a_file_that_is_no_video_are_refused(tmp_path, video):
    (tmp_path / "text.mp4").write_text("not a video")
    (tmp_path / "cut.avi").write_bytes(video.read_bytes()[:220])
    empty = tmp_path / "empty.avi"
    cv2.VideoWriter(str(empty), cv2.VideoWriter_fourcc(*"MJPG"), 10, (64, 48)).release()
    for path in (tmp_path / "text.mp4", tmp_path / "cut.avi", empty):
        with (
            FrameSource("video", path) as frames,
            pytest.raises(CameraError, match=rf"{path.name}: .*; expected frames"),
        ):
            list(frames)


def test_a_folder_without_images_and_one_with_a_broken_one_are_refused(tmp_path):
    with FrameSource("images", tmp_path) as frames, pytest.raises(CameraError, match="no images in this folder"):
        list(frames)
    (tmp_path / "a.png").write_text("not an image")
    with FrameSource("images", tmp_path) as frames, pytest.raises(CameraError, match=r"a\.png: not an image"):
        list(frames)


def huge(path):
    """A PNG of a few bytes that says it has 10^10 pixels."""
    import struct
    import zlib

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = struct.pack(">IIBBBBB", 100_000, 100_000, 8, 0, 0, 0, 0)
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"")) + chunk(b"IEND", b"")
    )
    return path


def test_an_image_that_would_unfold_to_gigabytes_is_refused(tmp_path):
    huge(tmp_path / "huge.png")
    with pytest.raises(InvalidInputError, match=r"huge\.png: cannot be read; expected an image"):
        read_image(tmp_path / "huge.png")
    with FrameSource("images", tmp_path) as frames, pytest.raises(CameraError, match=r"huge\.png"):
        list(frames)


@pytest.mark.parametrize("length", [2**20, 2**30, 2**31 - 1, 2**32 - 1])
def test_an_image_is_not_believed_that_a_part_of_it_is_longer_than_the_file(tmp_path, length):
    whole = huge(tmp_path / "a.png").read_bytes()
    (tmp_path / "a.png").write_bytes(whole.replace(whole[33:41], struct.pack(">I", length) + b"IDAT"))
    with pytest.raises(InvalidInputError, match=rf"a\.png: a part of {length} bytes, past its end"):
        read_image(tmp_path / "a.png")


def test_image_codecs_do_not_speak_in_the_place_of_the_error(tmp_path, capfd):
    head = b"\x89PNG\r\n\x1a\n" + struct.pack(">I4sIIBBBBB", 13, b"IHDR", 2**31 - 1, 2**31 - 1, 8, 0, 0, 0, 0)
    (tmp_path / "vast.png").write_bytes(head + struct.pack(">I", zlib.crc32(head[12:])))
    with pytest.raises(InvalidInputError, match=r"vast\.png: cannot be read"):
        read_image(tmp_path / "vast.png")
    assert capfd.readouterr() == ("", "")


def test_an_image_is_read_as_rgb(tmp_path):
    cv2.imwrite(str(tmp_path / "a.png"), np.full((4, 5, 3), (1, 2, 3), dtype=np.uint8))
    image = read_image(tmp_path / "a.png")
    assert image.shape == (4, 5, 3)
    assert image[0, 0].tolist() == [3, 2, 1]


def test_what_is_no_image_is_refused(tmp_path):
    (tmp_path / "a.png").write_text("not an image")
    for name, message in (("a.png", "cannot be read; expected an image"), ("b.png", "no such file; expected an image")):
        with pytest.raises(InvalidInputError, match=message):
            read_image(tmp_path / name)
