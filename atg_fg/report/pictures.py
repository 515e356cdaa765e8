"""The camera frames and crops that a record names, put into the page itself."""

from __future__ import annotations

import base64
import struct
from collections.abc import Iterable
from pathlib import Path, PurePosixPath
from typing import Final

from atg_fg.core import checks
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.looks import surest_looks
from atg_fg.core.records import StepSummary
from atg_fg.storage.checked_json import read_entries
from atg_fg.storage.plain_files import is_plain_file

_KINDS: Final = {b"\x89PNG\r\n\x1a\n": "image/png", b"\xff\xd8\xff": "image/jpeg"}
_MOST_BYTES: Final = 8_000_000
#: Of a crop: bytes of its file, and pixels of a side.
_MOST_CROP_BYTES: Final = 200_000
_MOST_CROP_SIDE: Final = 256
#: Characters of all crops in a page: of a hundred trials with pictures there are some three millions.
MOST_CROPS: Final = 20_000_000


def thumbnails(looks: Iterable[tuple[str, StepSummary]], folder: Path, room: int = MOST_CROPS) -> dict[int, str]:
    """Return for each symbol the crop that shows it most surely, the first one of several, as a ``data:`` address.

    Args:
        looks: Each look, and where it is, to be named in errors.
        folder: Where the record is.
        room: Characters that they may have together; nothing is returned if they have more.

    Raises:
        InvalidInputError: A crop that is no small PNG in the folder, or confidences that are none.
    """
    kept = [(place, step) for place, step in looks if step.crops]
    shown = [
        [None if path is None else symbol for symbol, path in zip(step.observed, step.crops, strict=True)]
        for _, step in kept
    ]
    sure = [_confidences(step, f"{place}: truth: confidences") for place, step in kept]
    found: dict[int, str] = {}
    for symbol, (look, slot) in surest_looks(shown, sure).items():
        place, step = kept[look]
        found[symbol] = _crop_address(step.crops[slot], folder, f"{place}: crops[{slot}]")
        room -= len(found[symbol])
        if room < 0:
            return {}
    return found


def _confidences(step: StepSummary, place: str) -> list[float | None]:
    stated = read_entries(step.truth.get("confidences") or [], place)
    if len(stated) not in (0, len(step.observed)):
        raise InvalidInputError(f"{place}: {len(stated)} entries; expected {len(step.observed)}")
    return [None if sure is None else checks.number(sure, where, 0.0, 1.0) for sure, where in stated]


def _crop_address(name: object, folder: Path, place: str) -> str:
    content, kind = _picture(name, folder, place, _MOST_CROP_BYTES)
    # Of a PNG, the first chunk begins with its size.
    sides = struct.unpack(">II", content[16:24]) if content[12:16] == b"IHDR" and len(content) >= 24 else (0, 0)
    if kind != "image/png" or not all(1 <= side <= _MOST_CROP_SIDE for side in sides):
        raise InvalidInputError(
            f"{place}: {checks.brief(name)}; expected a PNG of at most {_MOST_CROP_SIDE} pixels a side"
        )
    return _address(content, kind)


def data_address(name: object, folder: Path, place: str) -> str:
    """Return a picture as a ``data:`` address.

    Args:
        name: Its path from the record's folder, with forward slashes.
        folder: Where the record is.
        place: Named in errors.

    Raises:
        InvalidInputError: The path leads out of the folder, or is of no PNG or JPEG of at most 8 MB.
    """
    return _address(*_picture(name, folder, place, _MOST_BYTES))


def _picture(name: object, folder: Path, place: str, most: int) -> tuple[bytes, str]:
    if not isinstance(name, str) or not name or "\0" in name:
        raise InvalidInputError(f"{place}: {name!r}; expected the path of a picture")
    path = PurePosixPath(name)
    # A record from elsewhere must not put other files of this computer into a page.
    try:
        inside = (folder / path).resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError):  # links that lead in a circle
        inside = False
    if path.is_absolute() or not inside:
        raise InvalidInputError(f"{place}: {name!r}; expected a path inside the record's folder")
    if not is_plain_file(folder / path):
        raise InvalidInputError(f"{place}: {name!r} is no file; expected a picture")
    try:
        with (folder / path).open("rb") as file:
            content = file.read(most + 1)
    except OSError as error:
        raise InvalidInputError(f"{place}: {name!r} cannot be read: {error.strerror}; expected a picture") from error
    kind = next((kind for start, kind in _KINDS.items() if content.startswith(start)), None)
    if kind is None or len(content) > most:
        raise InvalidInputError(f"{place}: {name!r}; expected a PNG or JPEG picture of at most {most:,} bytes")
    return content, kind


def _address(content: bytes, kind: str) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"
