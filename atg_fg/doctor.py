"""What works on this machine: versions, and small checks with known answers.

Each check runs in a process of its own, since a broken library may take the interpreter with it. Packages beside this
one, such as ``sim``, add checks by the entry point ``atg_fg.checks``.
"""

from __future__ import annotations

import math
import platform
import subprocess
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, entry_points, requires, version
from typing import Final, Literal, TypeAlias

from packaging.requirements import Requirement

#: What a check is: it returns a line of what it found, or raises an error that says what is wrong.
Check: TypeAlias = Callable[[], str]
Status: TypeAlias = Literal["works", "missing", "broken"]

GROUP: Final = "atg_fg.checks"
#: Seconds that a check may take; the first import of a large library on a busy machine takes some.
TIME_LIMIT: Final = 120.0
_RUN: Final = "import sys; from atg_fg.doctor import run_check; run_check(sys.argv[1])"
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
    from atg_fg import Evidence, RobotMemory, arcube_assumptions, begin_trial, preset

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
