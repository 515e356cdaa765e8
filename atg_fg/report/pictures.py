"""The camera frames that a record names, put into the page itself."""

from __future__ import annotations

import base64
from pathlib import Path, PurePosixPath
from typing import Final

from atg_fg.core.errors import InvalidInputError
from atg_fg.storage.plain_files import is_plain_file

_KINDS: Final = {b"\x89PNG\r\n\x1a\n": "image/png", b"\xff\xd8\xff": "image/jpeg"}
_MOST_BYTES: Final = 8_000_000


def data_address(name: object, folder: Path, place: str) -> str:
    """Return a picture as a ``data:`` address.

    Args:
        name: Its path from the record's folder, with forward slashes.
        folder: Where the record is.
        place: Named in errors.

    Raises:
        InvalidInputError: The path leads out of the folder, or is of no PNG or JPEG of at most 8 MB.
    """
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
            content = file.read(_MOST_BYTES + 1)
    except OSError as error:
        raise InvalidInputError(f"{place}: {name!r} cannot be read: {error.strerror}; expected a picture") from error
    kind = next((kind for start, kind in _KINDS.items() if content.startswith(start)), None)
    if kind is None or len(content) > _MOST_BYTES:
        raise InvalidInputError(f"{place}: {name!r}; expected a PNG or JPEG picture of at most {_MOST_BYTES:,} bytes")
    return f"data:{kind};base64,{base64.b64encode(content).decode()}"
