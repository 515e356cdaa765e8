"""Execute the notebooks of this folder in place, with the sources of their paired scripts: ``make notebooks``.

``python notebooks/execute.py 03 06`` executes those two alone.
"""

import sys
from pathlib import Path

import jupytext
import nbformat
from nbclient import NotebookClient

FOLDER = Path(__file__).parent


def executed(path: Path) -> nbformat.NotebookNode:
    """Return the notebook executed in a fresh kernel; without times, so that the same run gives the same file."""
    notebook = nbformat.read(path, as_version=4)
    NotebookClient(
        notebook, timeout=600, kernel_name="python3", record_timing=False, resources={"metadata": {"path": FOLDER}}
    ).execute()
    return notebook


def main(numbers: list[str]) -> None:
    """Take the sources from the scripts, execute, and write the notebooks with their outputs."""
    for script in sorted(FOLDER.glob("[0-9]*.py")):
        if numbers and script.name[:2] not in numbers:
            continue
        path = script.with_suffix(".ipynb")
        source = jupytext.read(script)
        for number, cell in enumerate(source.cells):
            cell["id"] = f"cell-{number}"  # ids are drawn at random otherwise
        jupytext.write(source, path)
        nbformat.write(executed(path), path)
        print(f"executed {path.name}")


if __name__ == "__main__":
    main(sys.argv[1:])
