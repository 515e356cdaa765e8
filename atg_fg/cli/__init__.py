"""The command line: ``atg-fg``. Errors a user can mend become one line on standard error and exit status 2."""

from __future__ import annotations

import sys
from functools import cache
from importlib.metadata import entry_points
from typing import Annotated

import typer
import typer.exceptions

from atg_fg.cli import (
    ablation,
    demo,
    doctor,
    engines,
    experiments,
    explain,
    goal,
    memory,
    rescore,
    structure,
    trials,
    uai,
    watch,
)
from atg_fg.core.errors import AtgError
from atg_fg.core.version import __version__

app = typer.Typer(
    name="atg-fg",
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


app.command()(demo.demo)
app.command()(experiments.table1)
app.command()(experiments.figure3)
app.command()(ablation.ablation)
app.command()(rescore.rescore)
app.command()(goal.goal)
app.command()(trials.trial)
app.command()(trials.replay)
app.command()(explain.explain)
app.command()(watch.watch)
app.command()(engines.compare)
app.command()(engines.calibrate)
app.command()(doctor.doctor)
app.add_typer(memory.app, name="memory")
app.add_typer(structure.app, name="structure")
app.add_typer(uai.app, name="uai")


@cache
def add_commands_of_packages() -> None:
    """Add what packages beside this one offer by entry points: groups of commands (``sim``), single ones (``bench``).

    Not done when this package is imported: theirs import it, and could then not be imported by themselves.
    """
    for entry in entry_points(group="atg_fg.commands"):
        added = entry.load()
        if isinstance(added, typer.Typer):
            app.add_typer(added, name=entry.name)
        else:
            app.command(entry.name)(added)


def main() -> None:
    """Run the command line and leave with its exit status."""
    try:
        add_commands_of_packages()
        status = app(standalone_mode=False)
    except (AtgError, typer.exceptions.TyperException) as error:
        sys.exit(_fail(error))
    except (typer.Abort, KeyboardInterrupt):
        sys.exit(130)
    except BrokenPipeError:
        # The reader of a pipe has gone; nothing is wrong here.
        sys.stderr.close()
        sys.exit(141)
    sys.exit(status if isinstance(status, int) else 0)


def _fail(error: Exception) -> int:
    """Print one line about what went wrong and return the exit status 2."""
    message = str(error)
    if isinstance(error, typer.exceptions.TyperException):
        # The parser's own messages do not all hold the value; the command line does.
        message = f"{error.format_message()} (given: {' '.join(sys.argv[1:])}; see --help)"
    print(f"atg-fg: {' '.join(message.split())}", file=sys.stderr)
    return 2
