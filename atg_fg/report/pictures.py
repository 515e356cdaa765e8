"""The camera frames and crops that a record names, put into the page itself."""

from __future__ import annotations

import base64
import struct
from collections.abc import Iterable, Sequence
from pathlib import Path, PurePosixPath
from typing import Any, Final

from atg_fg.core import checks
from atg_fg.core.errors import InvalidInputError
from atg_fg.storage.checked_json import read_list
from atg_fg.storage.plain_files import is_plain_file

_KINDS: Final = {b"\x89PNG\r\n\x1a\n": "image/png", b"\xff\xd8\xff": "image/jpeg"}
_MOST_BYTES: Final = 8_000_000
#: Of a crop: bytes of its file, and pixels of a side.
_MOST_CROP_BYTES: Final = 200_000
_MOST_CROP_SIDE: Final = 256


def thumbnails(
    looks: Iterable[tuple[Sequence[int | None], object, object]], folder: Path, place: str
) -> dict[int, str]:
    """Return for each symbol the crop that shows it most surely, the first one of several, as a ``data:`` address.

    Args:
        looks: Of each look the symbols that were seen, and what the record has as confidences and as paths of crops,
            ``None`` without.
        folder: Where the record is.
        place: Named in errors.

    Raises:
        InvalidInputError: Not an entry for each slot, or one that is of no small PNG in the folder.
    """
    best: dict[int, tuple[float, object, str]] = {}
    for number, (symbols, confidences, crops) in enumerate(looks):
        if crops is None:
            continue
        where = f"{place}: line {number + 2}"
        paths = _of_slots(crops, len(symbols), f"{where}: crops")
        stated = _of_slots(confidences or [None] * len(symbols), len(symbols), f"{where}: truth: confidences")
        for slot, (symbol, path, sure) in enumerate(zip(symbols, paths, stated, strict=True)):
            surely = 0.0 if sure is None else checks.number(sure, f"{where}: truth: confidences[{slot}]", 0.0, 1.0)
            if symbol is not None and path is not None and surely > best.get(symbol, (-1.0,))[0]:
                best[symbol] = (surely, path, f"{where}: crops[{slot}]")
    return {symbol: _crop_address(crop, folder, where) for symbol, (_, crop, where) in sorted(best.items())}


def _of_slots(value: object, n_slots: int, place: str) -> list[Any]:
    entries = read_list(value, place)
    if len(entries) != n_slots:
        raise InvalidInputError(f"{place}: {len(entries)} entries; expected {n_slots}")
    return entries


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
