"""Reads frames for ``atg_fg.senses.video``, in a process of its own, and writes them to standard output.

Run as a file: it imports nothing of this package, so that it begins at once. A camera's driver may hang and a damaged
video may crash its decoder; then this process is ended, or ends, and the one that asked for frames goes on.

Each message is a header and a body: a frame (RGB bytes), an error (text), or the end.
"""

from __future__ import annotations

import os
import struct
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

#: What kind of message, height, width, bytes of the body, and the time of the frame, s.
HEADER = struct.Struct("<iiiid")
FRAME, ERROR, END = range(3)
#: Names of image files end so, lower or upper case.
IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff", ".webp", ".ppm", ".pgm")
#: Images of more pixels are refused; OpenCV reads this limit when it is imported.
MOST_PIXELS = 2**26
_MOST_MEMORY = 4 * 2**30  # bytes
_USUAL_RATE = 30.0  # frames a second, where a video does not say


def main(kind: str, name: str) -> None:
    """Write the frames of a camera, a video or a folder of images to standard output."""
    os.environ["OPENCV_IO_MAX_IMAGE_PIXELS"] = str(MOST_PIXELS)
    os.environ["OPENCV_LOG_LEVEL"] = "SILENT"
    _limit_memory()
    sources = {"camera": _of_camera, "video": _of_video, "images": _of_images}
    try:
        for time, image in sources[kind](name):
            _send(FRAME, image.tobytes(), image.shape[0], image.shape[1], time)
        _send(END)
    except BrokenPipeError:
        os._exit(0)  # nobody wants more frames
    except Exception as error:
        _send(ERROR, str(error).encode())


def _limit_memory() -> None:
    try:
        import resource
    except ImportError:  # not on Windows
        return
    resource.setrlimit(resource.RLIMIT_AS, (_MOST_MEMORY, _MOST_MEMORY))


def _send(kind: int, body: bytes = b"", height: int = 0, width: int = 0, time: float = 0.0) -> None:
    sys.stdout.buffer.write(HEADER.pack(kind, height, width, len(body), time))
    sys.stdout.buffer.write(body)
    sys.stdout.buffer.flush()


def _of_camera(name: str) -> Iterator[tuple[float, Any]]:
    import cv2

    capture = cv2.VideoCapture(int(name))
    if not capture.isOpened():
        raise ValueError("no such camera, or another program has it")
    begun = cv2.getTickCount()
    while True:
        good, image = capture.read()
        if not good:
            raise ValueError("the camera has stopped")
        yield (cv2.getTickCount() - begun) / cv2.getTickFrequency(), _rgb(image)


def _of_video(name: str) -> Iterator[tuple[float, Any]]:
    import cv2

    capture = cv2.VideoCapture(name)
    if not capture.isOpened():
        raise ValueError("not a video that OpenCV can read")
    told = capture.get(cv2.CAP_PROP_FPS)
    rate = told if 0 < told < 1000 else _USUAL_RATE
    number = 0
    while True:
        good, image = capture.read()
        if not good:
            break
        yield number / rate, _rgb(image)
        number += 1
    if not number:
        raise ValueError("a video without frames")


def _of_images(name: str) -> Iterator[tuple[float, Any]]:
    import cv2

    folder = Path(name)
    files = (
        sorted(file for file in folder.iterdir() if file.suffix.lower() in IMAGE_SUFFIXES)
        if os.path.isdir(folder)
        else []
    )
    if os.path.isfile(folder):
        files = [folder]
    if not files:
        raise ValueError("no images in this folder")
    for number, file in enumerate(files):
        try:
            image = cv2.imread(str(file), cv2.IMREAD_COLOR)
        except cv2.error as error:
            raise ValueError(f"{file.name}: more than {MOST_PIXELS} pixels, or no image") from error
        if image is None:
            raise ValueError(f"{file.name}: not an image that OpenCV can read")
        yield float(number), _rgb(image)


def _rgb(image: Any) -> Any:
    import cv2

    if image.shape[0] * image.shape[1] > MOST_PIXELS:
        raise ValueError(f"{image.shape[1]} by {image.shape[0]} pixels, more than {MOST_PIXELS}")
    if image.ndim == 2:
        return cv2.cvtColor(image, cv2.COLOR_GRAY2RGB)
    return cv2.cvtColor(image, cv2.COLOR_BGR2RGB)


if __name__ == "__main__":
    main(*sys.argv[1:])
