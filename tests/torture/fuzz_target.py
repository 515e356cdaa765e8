"""What atheris calls with each input; its arguments are those of libFuzzer. Run by ``fuzz.py``."""

from __future__ import annotations

import sys
import tempfile
import warnings
from contextlib import suppress
from pathlib import Path

import atheris

with atheris.instrument_imports(
    include=["atg_fg.storage", "atg_fg.core", "atg_fg.report", "atg_fg.experiments", "sim"]
):
    from atg_fg.core.errors import AtgError
    from tests.torture import reading

from tests.torture.fuzz import as_file
from tests.torture.mutations import FAST

_FOLDER = tempfile.TemporaryDirectory(dir=FAST)


def read_one(data: bytes) -> None:
    """Read what an input stands for; any error but this project's own is a fault."""
    if not data:
        return
    kind, content = as_file(data)
    with suppress(AtgError):
        reading.read_as(kind, content, Path(_FOLDER.name))


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    reading.warm_up(Path(_FOLDER.name))
    atheris.Setup(sys.argv, read_one)
    atheris.Fuzz()
