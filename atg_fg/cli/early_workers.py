"""Workers of a campaign that are begun before its command: what forks them loads beside the command itself."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence
from itertools import pairwise
from typing import Final

#: Options with which a command has no worker processes of its own, with the values that say so; any, if there are none.
_WITHOUT: Final = {"--help": (), "--executor": (), "--jobs": ("1",), "--tests": ("1",)}


def begin_workers_early(arguments: Sequence[str]) -> None:
    """Begin a worker server, if it seems from a command's arguments that it will want one.

    A wrong guess costs time and nothing else: a server is begun when it is wanted, and ends with the command.
    """
    if sys.platform == "linux" and len(os.sched_getaffinity(0)) > 1 and not _is_without(arguments):
        from atg_fg.experiments.executors.fork_server import begin_early

        begin_early()


def _is_without(arguments: Sequence[str]) -> bool:
    words = [word for argument in arguments for word in argument.split("=", 1)]
    return any(
        word in _WITHOUT and (not _WITHOUT[word] or following in _WITHOUT[word])
        for word, following in pairwise([*words, ""])
    )
