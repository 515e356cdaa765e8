"""What the simulator needs, and how PyBullet is imported without its banner."""

from __future__ import annotations

import ctypes
import importlib.util
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from atg_fg.core.errors import MissingDependencyError

_REQUIRED = {"pybullet": "pybullet", "cv2": "opencv-python-headless"}


def require_simulator() -> None:
    """Raise ``MissingDependencyError`` if PyBullet or OpenCV is not installed."""
    for module, distribution in _REQUIRED.items():
        if importlib.util.find_spec(module) is None:
            raise MissingDependencyError(
                f"simulated worlds: the package {distribution} is not installed; expected the extra 'sim': "
                'pip install "atg-fg[sim]" on Python 3.11, the last version that PyBullet has wheels for'
            )


def import_quietly(module: str) -> None:
    """Import a module that prints a banner from C on standard error, without the banner.

    What comes there from this project is a fault, in one line.
    """
    if module in sys.modules:
        return
    sys.stderr.flush()
    with silenced(2):
        importlib.import_module(module)


@contextmanager
def silenced(stream: int) -> Iterator[None]:
    """Drop what C code prints on standard output (1) or standard error (2) meanwhile.

    PyBullet tells on standard output what it thinks of a robot, where a command's JSON goes.
    """
    flush = ctypes.CDLL(None).fflush if os.name == "posix" else lambda _: None
    flush(None)
    kept, nowhere = os.dup(stream), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, stream)
        yield
    finally:
        flush(None)
        os.dup2(kept, stream)
        os.close(kept)
        os.close(nowhere)
