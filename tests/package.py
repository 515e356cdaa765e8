"""``make package``: the wheel in ``dist`` is tried as others get it, in an empty environment outside the tree."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import tempfile
import venv
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).parents[1]
#: So many commands of the tour need nothing beside the package.
N_COMMANDS: Final = 3


def main() -> None:
    """Install the wheel, run the first commands of the tour, and compare what they print."""
    sys.path.insert(0, str(ROOT / "docs"))
    import tour

    (wheel,) = (ROOT / "dist").glob("*.whl")
    (source,) = (ROOT / "dist").glob("*.tar.gz")
    print(f"{wheel.name}: {wheel.stat().st_size / 1e6:.1f} MB, {source.name}: {source.stat().st_size / 1e6:.1f} MB")
    with tempfile.TemporaryDirectory() as name:
        programs, folder = Path(name) / "environment" / "bin", Path(name) / "empty"
        folder.mkdir()
        venv.create(programs.parent, with_pip=True)
        environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        environment |= {**tour.ENVIRONMENT, "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}"}

        def output_of(line: str) -> list[str]:
            program, *arguments = shlex.split(line)
            done = subprocess.run(
                [programs / program, *arguments],
                cwd=folder,
                env=environment,
                capture_output=True,
                text=True,
                check=False,
            )
            if done.returncode:
                sys.exit(f"{line}: exit status {done.returncode}\n{done.stderr}")
            return tour.printed(done.stdout)

        output_of(f"pip install --quiet {wheel}")
        place = output_of('python -c "import atg_fg; print(atg_fg.__file__)"')
        if not Path(place[0]).is_relative_to(name):
            sys.exit(f"the package is that of {place[0]}; expected the one of the wheel")
        for command in tour.commands()[:N_COMMANDS]:
            lines = output_of(command.line)
            if lines[: len(command.output)] != command.output:
                sys.exit("\n".join([f"$ {command.line}", *lines, "expected:", *command.output]))
            print(f"$ {command.line}")
        for line in ("atg-fg --help", "atg-fg doctor"):
            print(f"$ {line}", *output_of(line), sep="\n")


if __name__ == "__main__":
    main()
