"""Frames from a camera, a video or images, with a time-out: reading never hangs."""

from __future__ import annotations

import os
import queue
import subprocess
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import TIMEOUT_MAX, Thread
from typing import IO, Final, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.errors import CameraError, InvalidInputError
from atg_fg.core.silence import silenced
from atg_fg.senses import frame_reader
from atg_fg.senses.opencv import cv2

Source: TypeAlias = Literal["camera", "video", "images"]
#: Seconds that a frame may take, the first one too.
TIMEOUT: Final = 10.0
_MOST_CAMERAS: Final = 99
_PNG: Final = b"\x89PNG\r\n\x1a\n"
_AHEAD = 4  # frames read ahead from a file


@dataclass(frozen=True, eq=False)
class Frame:
    """One frame.

    Attributes:
        time: Seconds since the first one; of images, their number.
        image: RGB, shape [height, width, 3].
    """

    time: float
    image: NDArray[np.uint8]


class FrameSource:
    """Iterates over the frames of a camera, a video or images; a context manager, which ends the reading.

    Frames are read in a process of its own, which is ended if no frame comes in time. A camera is always asked for its
    last frame: those that came meanwhile are left out. A video gives every frame.

    Args:
        source: ``"camera"``, ``"video"`` or ``"images"``.
        name: Number of the camera; path or address of the video; path of an image or of a folder of images, which are
            taken in the order of their names.
        timeout: Seconds that a frame may take.

    Raises:
        InvalidInputError: No such file, no number of a camera, a time-out that is not above 0.
        CameraError: While iterating: no frame in time, no camera, nothing that can be read.
    """

    def __init__(self, source: Source, name: int | str | Path, timeout: float = TIMEOUT) -> None:
        if not 0 < timeout <= TIMEOUT_MAX:
            raise InvalidInputError(
                f"time-out of a camera: {timeout!r}; expected seconds above 0, at most {TIMEOUT_MAX:g}"
            )
        self.place = f"{source} {name}" if source == "camera" else str(name)
        _check_name(source, str(name))
        self.timeout = timeout
        self._live = source == "camera"
        self._messages: queue.Queue[tuple[int, tuple[int, int], float, bytes]] = queue.Queue(
            1 if self._live else _AHEAD
        )
        command = [sys.executable, "-P", frame_reader.__file__, source, str(name)]
        self._process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        self._closed = False
        self._thread = Thread(target=self._receive, daemon=True)
        self._thread.start()

    def __enter__(self) -> FrameSource:
        return self

    def __exit__(self, *raised: object) -> None:
        self.close()

    def __iter__(self) -> Iterator[Frame]:
        while True:
            try:
                kind, shape, time, body = self._messages.get(timeout=self.timeout)
            except queue.Empty:
                self.close()
                raise CameraError(
                    f"{self.place}: no frame within {self.timeout:g} s; expected one, or a longer time-out"
                ) from None
            if kind == frame_reader.END:
                return
            if kind == frame_reader.ERROR:
                self.close()
                raise CameraError(f"{self.place}: {body.decode(errors='replace')}; expected frames")
            yield Frame(time, np.frombuffer(body, dtype=np.uint8).reshape(*shape, 3))

    def close(self) -> None:
        """End the reading; no frames come any more."""
        self._closed = True
        self._process.kill()
        while self._thread.is_alive():
            # The thread may be waiting for a place in the queue.
            try:
                self._messages.get_nowait()
            except queue.Empty:
                self._thread.join(0.01)
        self._process.wait()
        if self._process.stdout is not None:
            self._process.stdout.close()

    def _receive(self) -> None:
        """Take in what the process writes, until it ends or the source is closed."""
        pipe = self._process.stdout
        assert pipe is not None
        while not self._closed:
            header = _exactly(pipe, frame_reader.HEADER.size)
            if header is None:
                self._put((frame_reader.ERROR, (0, 0), 0.0, b"the reader of frames has broken down"))
                return
            kind, height, width, length, time = frame_reader.HEADER.unpack(header)
            body = _exactly(pipe, length)
            if body is None:
                continue
            self._put((kind, (height, width), time, body))
            if kind != frame_reader.FRAME:
                return

    def _put(self, message: tuple[int, tuple[int, int], float, bytes]) -> None:
        if self._live:
            with suppress(queue.Empty):
                self._messages.get_nowait()  # nobody took it: it is old by now
        if not self._closed:
            self._messages.put(message)


def _exactly(pipe: IO[bytes], length: int) -> bytes | None:
    """Return the next bytes of a pipe, ``None`` if it ends before."""
    try:
        read = pipe.read(length)
    except ValueError:  # closed meanwhile
        return None
    return read if len(read) == length else None


def _check_name(source: Source, name: str) -> None:
    if source == "camera":
        if not (name.isascii() and name.isdecimal() and int(name) <= _MOST_CAMERAS):
            raise InvalidInputError(
                f"camera: {name!r}; expected its number, 0 for the first one, at most {_MOST_CAMERAS}"
            )
    elif source == "video":
        if "://" not in name:
            check_plain_file(name, "a video")
    elif not os.path.isdir(name):
        check_plain_file(name, "an image, or a folder of images")


def check_plain_file(path: str | Path, expected: str) -> None:
    """Raise ``InvalidInputError`` unless there is a plain file at ``path``: one that can be read again, and ends."""
    there = Path(path)
    if not os.path.isfile(there):
        what = "a folder" if os.path.isdir(there) else "no plain file" if os.path.exists(there) else "no such file"
        raise InvalidInputError(f"{path}: {what}; expected {expected}")


def _check_parts(path: str | Path) -> None:
    """Raise ``InvalidInputError`` if a PNG says of a part of it that it is longer than the file: OpenCV believes it."""
    with open(path, "rb") as file:
        if file.read(len(_PNG)) != _PNG:
            return
        end, begin = os.path.getsize(path), len(_PNG)
        while begin < end:
            file.seek(begin)
            length = int.from_bytes(file.read(4), "big")
            begin += 12 + length  # with length, name and checksum
        if begin > end:
            raise InvalidInputError(f"{path}: a part of {length} bytes, past its end; expected a whole image")


def read_image(path: str | Path) -> NDArray[np.uint8]:
    """Return an image, RGB, shape [height, width, 3].

    Raises:
        InvalidInputError: It cannot be read, is no image, or has more than ``frame_reader.MOST_PIXELS`` pixels.
    """
    check_plain_file(path, "an image")
    try:
        _check_parts(path)
        with silenced(2):
            image = cv2.imread(str(path), cv2.IMREAD_COLOR)
    except OSError as error:
        raise InvalidInputError(f"{path}: cannot be read: {error.strerror}; expected an image") from error
    except cv2.error as error:
        raise InvalidInputError(
            f"{path}: cannot be read; expected an image of at most {frame_reader.MOST_PIXELS} pixels"
        ) from error
    if image is None:
        raise InvalidInputError(f"{path}: cannot be read; expected an image, such as PNG or JPEG")
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2RGB), dtype=np.uint8)
