import sys

import pytest

from atg_fg import cli
from atg_fg.experiments.executors import fork_server


@pytest.fixture
def run(monkeypatch, capsys):
    """Run the command line in this process; return its exit status, standard output and standard error."""

    # Whether loops are compiled now or were before is no business of these tests.
    monkeypatch.setattr(cli, "tell_of_compilation", lambda tell: None)
    # Nor is whether workers are begun a second earlier.
    monkeypatch.setattr(fork_server, "begin_early", lambda: None)

    def called(*arguments):
        monkeypatch.setattr(sys, "argv", ["atg-fg", *map(str, arguments)])
        with pytest.raises(SystemExit) as left:
            cli.main()
        printed = capsys.readouterr()
        return left.value.code, printed.out, printed.err

    return called


@pytest.fixture
def refused(run):
    """Run the command line, check that it refuses in the promised way, and return its one line."""

    def called(*arguments):
        status, output, error = run(*arguments)
        assert status == 2
        assert output == ""
        assert error.count("\n") == 1
        assert "Traceback" not in error
        return error

    return called
