"""The notebooks run, say what their paired scripts say, and keep their outputs."""

import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))


@pytest.fixture(scope="module")
def execute():
    sys.path.insert(0, str(FOLDER))
    yield __import__("execute")
    sys.path.remove(str(FOLDER))


def read(path):
    """Return a notebook, or what is paired with it; the libraries take a second of each worker that collects this."""
    import jupytext
    import nbformat

    return nbformat.read(path, as_version=4) if path.suffix == ".ipynb" else jupytext.read(path)


def sources(notebook):
    return [(cell.cell_type, cell.source) for cell in notebook.cells]


def test_there_are_these_notebooks_in_reading_order():
    assert [path.stem[:2] for path in NOTEBOOKS] == [f"{number:02}" for number in range(1, 13)]


# A kernel's sockets are closed by its own threads, some time after the test; that is none of this project's.
@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.filterwarnings("ignore::DeprecationWarning:zmq", "ignore::RuntimeWarning:zmq")
@pytest.mark.parametrize(
    "path",
    [NOTEBOOKS[0], *(pytest.param(each, marks=pytest.mark.slow) for each in NOTEBOOKS[1:])],
    ids=lambda path: path.stem,
)
def test_a_notebook_runs_from_its_first_cell_to_its_last(path, execute):
    before = path.read_bytes()
    notebook = execute.executed(path)
    assert all(cell.execution_count for cell in notebook.cells if cell.cell_type == "code" and cell.source)
    assert path.read_bytes() == before


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_and_its_script_say_the_same(path):
    assert sources(read(path.with_suffix(".py"))) == sources(read(path))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_outputs_are_kept_and_none_is_an_error(path):
    outputs = [output for cell in read(path).cells for output in cell.get("outputs", [])]
    assert any("image/png" in output.get("data", {}) for output in outputs)
    assert {output.output_type for output in outputs} <= {"stream", "execute_result", "display_data"}
    assert not any(output.get("name") == "stderr" for output in outputs)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_cells_are_short_and_need_no_file_of_a_checkout(path):
    sources_of_code = [cell.source for cell in read(path).cells if cell.cell_type == "code"]
    assert max(len(source.splitlines()) for source in sources_of_code) < 20
    assert not any("../" in source for source in sources_of_code)
