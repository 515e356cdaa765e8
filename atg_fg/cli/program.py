"""The program ``atg-fg``: Ctrl-C ends it from its first line on, also while libraries are loaded.

Before that, while Python itself begins, it is Python that answers, and no program can change that. It is installed
beside the package, as ``atg_fg_program``: ``atg_fg.cli.program`` would import ``atg_fg`` first.
"""

import os
import signal
from types import FrameType


def _leave(signal_number: int, frame: FrameType | None) -> None:
    # No exception: libraries that are being loaded turn it into errors of their own.
    os._exit(130)


def main() -> None:
    """Run the command line; when a command has been loaded, Ctrl-C is an exception to it (``LazyCommand``)."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not where a shell said to ignore it
        signal.signal(signal.SIGINT, _leave)
    from atg_fg.cli import main as run

    run()
