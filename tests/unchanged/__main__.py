"""Write down what the command line gives: ``python -m tests.unchanged [NAME ...]`` in the folder above ``tests``.

A name is that of a case, of a part (``learned``: all that preset ``learned`` gives; ``rest``), or ``scripts``, which
draws the ten scripted trials in ``data/inputs`` once more. Without a name all cases are run. Do so only where output
has changed on purpose, for the part that it changed in: the changes are then seen in what is printed. Each case is run
twice, and nothing is written if the two runs differ.
"""

import difflib
import sys

from tests.unchanged.cases import CASES
from tests.unchanged.running import expected, transcript, write_down
from tests.unchanged.scripts import write_scripts


def main(names: list[str]) -> None:
    """Write down the cases of these names or parts."""
    known = {"scripts", *(case.name for case in CASES), *(case.part for case in CASES)}
    if unknown := set(names) - known:
        sys.exit(f"unknown: {', '.join(sorted(unknown))}; expected some of {', '.join(sorted(known))}")
    if "scripts" in names:
        write_scripts()
    for case in CASES:
        if names and case.name not in names and case.part not in names:
            continue
        text = transcript(case)
        if transcript(case) != text:
            sys.exit(f"{case.name}: two runs differ")
        try:
            before, _ = expected(case)
        except FileNotFoundError:
            before = ""
        changes = list(difflib.unified_diff(before.splitlines(), text.splitlines(), lineterm="", n=0))
        print(f"{case.name}: {len(text)} characters, {len(changes)} lines of difference", *changes[:20], sep="\n  ")
        write_down(case, text)


if __name__ == "__main__":
    main(sys.argv[1:])
