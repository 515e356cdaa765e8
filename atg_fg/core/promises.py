"""What the checks of engines, policies and worlds of a user's own have in common."""

from __future__ import annotations

import random

import numpy as np


def require(holds: bool, message: str) -> None:
    """Raise ``AssertionError`` with a message unless what was promised holds."""
    if not holds:
        raise AssertionError(message)


def shared_generators() -> str:
    """Return the state of the random generators that everyone shares, which no part of a trial may use."""
    return repr((random.getstate(), np.random.get_state()))  # noqa: NPY002 - it is to be left alone
