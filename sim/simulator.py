"""What the simulator needs, and how PyBullet is imported without its banner."""

from __future__ import annotations

import importlib.util
import sys

from atg_fg.core.errors import MissingDependencyError
from atg_fg.core.silence import silenced

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
