"""Text from data as it may be shown: what would steer a terminal, or hide in a line, is written out."""

from __future__ import annotations

import re
from typing import Final

#: Control characters, separators of lines and paragraphs, marks that turn the direction of text, half characters.
_STEERING: Final = re.compile("[\0-\x1f\x7f-\x9f\u061c\u200b\u200e\u200f\u2028-\u202e\u2060-\u2069\ufeff\ud800-\udfff]")


def visible(text: str, keep: str = "") -> str:
    r"""Return a text with each invisible character written out, such as ``\x1b``.

    Args:
        text: Anything, such as the name of an object in a file from somewhere.
        keep: Characters that stay as they are.
    """
    return _STEERING.sub(lambda found: found[0] if found[0] in keep else _written_out(found[0]), text)


def _written_out(character: str) -> str:
    return character.encode("unicode_escape").decode("ascii")
