"""The command line: ``atg-fg``. Errors a user can mend become one line on standard error and exit status 2."""

from __future__ import annotations

import errno
import os
import sys
from io import TextIOWrapper
from typing import Annotated, Any, Final

import typer
import typer.exceptions

from atg_fg.cli.lazy_commands import LazyCommand, LazyGroup
from atg_fg.core.errors import AtgError, InvalidInputError
from atg_fg.core.plugins import registered
from atg_fg.core.version import __version__
from atg_fg.core.visible_text import visible
from atg_fg.inference.kernels.compilation import tell_of_compilation

#: The commands, and groups of them, by the panel of the help page that they stand in; each with its place.
COMMANDS: Final = {
    "Try it": {
        "demo": "atg_fg.cli.demo:demo",
        "trial": "atg_fg.cli.trials:trial",
        "watch": "atg_fg.cli.demo:watch",
        "doctor": "atg_fg.cli.doctor:doctor",
    },
    "Your data": {
        "learn": "atg_fg.cli.recordings:learn",
        "recognise": "atg_fg.cli.recordings:recognise",
        "recordings": "atg_fg.cli.recording_files:app",
        "replay": "atg_fg.cli.trials:replay",
        "explain": "atg_fg.cli.explain:explain",
        "uai": "atg_fg.cli.uai:app",
    },
    "Camera": {
        "look": "atg_fg.cli.look:look",
        "live": "atg_fg.cli.live:live",
        "camera": "atg_fg.cli.camera:app",
        "print": "atg_fg.cli.printing:app",
    },
    "Memory": {
        "memory": "atg_fg.cli.memory:app",
    },
    "Experiments": {
        "table1": "atg_fg.cli.experiments:table1",
        "figure3": "atg_fg.cli.experiments:figure3",
        "ablation": "atg_fg.cli.experiments:ablation",
        "rescore": "atg_fg.cli.rescore:rescore",
        "goal": "atg_fg.cli.goal:goal",
    },
    "Engines": {
        "engines": "atg_fg.cli.engines:app",
    },
}

#: The panels of those that packages beside this one offer by entry points.
OFFERED: Final = {"report": "Your data", "bench": "Engines", "sim": "Simulation"}
#: What is called before a command is imported that runs trials in worker processes.
BEFORE: Final = dict.fromkeys(("table1", "figure3", "ablation", "goal"), "atg_fg.cli.early_workers:begin_workers_early")
#: Commands of earlier versions, and what they are called now.
MOVED: Final = {"compare": "engines compare", "calibrate": "engines check", "structure": "memory structure"}

#: A pipe whose reader has gone, a disk that is full or faulty, a file that may not grow.
_OUTPUT_ERRORS: Final = (errno.EPIPE, errno.ENOSPC, errno.EIO, errno.EFBIG, errno.EDQUOT)


class _Commands(LazyGroup):
    """The commands of this package, and those of packages beside it."""

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        for panel, places in COMMANDS.items():
            for name, place in places.items():
                self.add_command(LazyCommand(name, place, panel, BEFORE.get(name)))
        for entry in registered("atg_fg.commands").values():
            self.add_command(LazyCommand(entry.name, entry.value, OFFERED.get(entry.name, "More")))

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return the command of this name; say where one went that has another name now."""
        if cmd_name in MOVED:
            raise InvalidInputError(f"{cmd_name}: this command has another name now; expected atg-fg {MOVED[cmd_name]}")
        return super().get_command(ctx, cmd_name)


app = typer.Typer(
    name="atg-fg",
    cls=_Commands,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"atg-fg {__version__}")
        raise typer.Exit


@app.callback()
def _common(
    version: Annotated[
        bool, typer.Option("--version", callback=_print_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Recognise objects by acting on them: Aspect Transition Graphs as discrete factor graphs.

    Example: atg-fg demo
    """


def main() -> None:
    """Run the command line and leave with its exit status."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # for terminals, and file names, of other encodings
    tell_of_compilation(_say_that_loops_are_compiled)
    try:
        status = app(standalone_mode=False)
        sys.stdout.flush()
    except (AtgError, typer.exceptions.TyperException) as error:
        sys.exit(_fail(error))
    except (typer.Abort, KeyboardInterrupt):
        sys.exit(130)
    except (OSError, SystemExit) as error:
        sys.exit(_left_by_output(error))
    sys.exit(status if isinstance(status, int) else 0)


def _say_that_loops_are_compiled() -> None:
    print("atg-fg: compiling loops, which takes up to a minute the first time", file=sys.stderr, flush=True)


def _left_by_output(error: OSError | SystemExit) -> int:
    """Return the exit status where standard output cannot be written to; raise any other error again.

    Errors of files have been made ``AtgError`` where they came up, or name the file.
    """
    # Rich leaves by SystemExit where the reader of a pipe has gone.
    cause = error.__context__ if isinstance(error, SystemExit) else error
    if not isinstance(cause, OSError) or cause.errno not in _OUTPUT_ERRORS or cause.filename is not None:
        raise error
    # What could not be written is not tried once more when Python leaves.
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    if isinstance(cause, BrokenPipeError):
        return 141  # as of a program that this ends; nothing is wrong here
    return _fail(InvalidInputError(f"standard output: {cause.strerror}"))


def _fail(error: Exception) -> int:
    """Print one line about what went wrong and return the exit status 2."""
    message = str(error)
    if isinstance(error, typer.exceptions.TyperException):
        # The parser's own messages do not all hold the value; the command line does.
        message = str(AtgError(f"{error.format_message()} (given: {' '.join(sys.argv[1:])}; see --help)"))
    print(f"atg-fg: {visible(' '.join(message.split()))}", file=sys.stderr)
    return 2
