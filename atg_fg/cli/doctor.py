"""``atg-fg doctor``: what works on this machine."""

from __future__ import annotations

import math
import platform
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, entry_points, requires, version
from typing import Final, Literal, TypeAlias

import typer
from packaging.requirements import Requirement
from rich.table import Table
from rich.text import Text

from atg_fg.cli import options

_STYLES: Final = {"works": "green", "missing": "yellow", "broken": "red"}


def doctor(json_file: options.JsonFile = None) -> None:
    """Check versions, inference, and what is installed of the rest; leave with 1 if the core does not work.

    Example: atg-fg doctor
    """
    findings = diagnose()
    if options.write_json({"command": "doctor", "findings": [asdict(finding) for finding in findings]}, json_file):
        options.console().print(_table(findings))
    if any(finding.required and finding.status != "works" for finding in findings):
        raise typer.Exit(1)


def _table(findings: list[Finding]) -> Table:
    table = Table("", "", "found, or what to do", title="What works here", title_justify="left")
    for finding in findings:
        table.add_row(finding.subject, Text(finding.status, style=_STYLES[finding.status]), finding.detail)
    return table


#: What a check is: it returns a line of what it found, or raises an error that says what is wrong.
Check: TypeAlias = Callable[[], str]
Status: TypeAlias = Literal["works", "missing", "broken"]
GROUP: Final = "atg_fg.checks"
#: Seconds that a check may take; the first import of a large library on a busy machine takes some.
TIME_LIMIT: Final = 120.0
_RUN: Final = "import sys; from atg_fg.cli.doctor import run_check; run_check(sys.argv[1])"
#: Exit status by which a check says that a library is not installed.
_MISSING: Final = 3


@dataclass(frozen=True)
class Finding:
    """What one check found.

    Attributes:
        subject: What was checked.
        status: Whether it works, is not installed, or is broken.
        detail: One line: what was found, or what to do.
        required: Whether the core does not work without it.
    """

    subject: str
    status: Status
    detail: str
    required: bool = False


def inference_check() -> str:
    """Infer one belief with GTSAM whose value is known: the first look at a remembered object."""
    from atg_fg.core.assumptions import arcube_assumptions
    from atg_fg.core.memory import RobotMemory
    from atg_fg.core.patterns import Evidence
    from atg_fg.engines import begin_trial
    from atg_fg.storage.presets import preset

    memory = RobotMemory(arcube_assumptions())
    memory.learn([0, 1], [0], matched=None)
    trial = begin_trial("gtsam", memory, preset("paper"))
    trial.observe(Evidence.of_detection(memory.assumptions.alphabet, memory.assumptions.alphabet.patterns[0]))
    # The object shows the pattern in one of its 24 aspects; each of 99 others shows any of 132 alike.
    expected = (1 / 24) / (1 / 24 + 99 / 132)
    found = float(trial.identity().probabilities[0])
    if not math.isclose(found, expected, rel_tol=1e-5):
        raise ArithmeticError(f"p(known) = {found:.9g}; expected {expected:.9g}")
    return f"p(known) after one look is {found:.6f}, as by hand"


#: The checks of the core, by subject.
CHECKS: Final[Mapping[str, Check]] = {"inference": inference_check}


def diagnose() -> list[Finding]:
    """Return what all checks found, the interpreter and required libraries first."""
    findings = [Finding("Python", "works", f"{platform.python_version()} on {platform.system()} {platform.machine()}")]
    findings += libraries()
    findings += [_checked(name, required=True) for name in CHECKS]
    findings += [_checked(name, required=False) for name in sorted(entry_points(group=GROUP).names)]
    return findings


def libraries() -> list[Finding]:
    """Return for each library of the core and of the extras whether it is installed, and in which version."""
    findings = []
    for text in requires("atg-fg") or []:
        requirement = Requirement(text)
        extra = str(requirement.marker).rpartition("extra == ")[2].strip("\"'") if requirement.marker else ""
        installed = _installed(requirement.name)
        if installed is None:
            what_to_do = f"pip install 'atg-fg[{extra}]'" if extra else f"pip install '{requirement.name}'"
            findings.append(Finding(requirement.name, "missing", what_to_do, required=not extra))
        elif not requirement.specifier.contains(installed, prereleases=True):
            detail = f"{installed}; expected {requirement.specifier}"
            findings.append(Finding(requirement.name, "broken", detail, required=not extra))
        else:
            findings.append(Finding(requirement.name, "works", installed, required=not extra))
    # A library that several extras need is named once.
    return list({finding.subject: finding for finding in reversed(findings)}.values())[::-1]


def run_check(name: str) -> None:
    """Run one check in this process and leave with the status that ``diagnose`` reads."""
    try:
        check = CHECKS[name] if name in CHECKS else entry_points(group=GROUP)[name].load()
        print(check())
    except ImportError as error:
        print(error)
        sys.exit(_MISSING)
    except Exception as error:  # whatever it is, it is what was found
        print(f"{type(error).__name__}: {error}")
        sys.exit(1)


def _installed(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


def _checked(name: str, *, required: bool) -> Finding:
    """Run a check in a process of its own."""
    try:
        done = subprocess.run(
            [sys.executable, "-c", _RUN, name], capture_output=True, text=True, timeout=TIME_LIMIT, check=False
        )
    except subprocess.TimeoutExpired:
        return Finding(name, "broken", f"no answer in {TIME_LIMIT:.0f} s", required)
    lines = done.stdout.strip().splitlines()
    said = lines[-1] if lines else ""
    if done.returncode == 0:
        return Finding(name, "works", said, required)
    if done.returncode == _MISSING:
        return Finding(name, "missing", said, required)
    if done.returncode < 0:
        return Finding(name, "broken", f"the interpreter was ended by signal {-done.returncode}", required)
    return Finding(name, "broken", said or "no message", required)
