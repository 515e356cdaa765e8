import json
import platform
import subprocess
import sys

import pytest

from benchmarks.cli import BEGIN, END


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("bench")


@pytest.fixture
def page(folder):
    path = folder / "page.md"
    path.write_text(f"# Title\n{BEGIN}\nold\n{END}\nend\n")
    return path


@pytest.mark.slow
def test_a_quick_run_measures_everything_and_writes_it(run, folder, page):
    status, output, _ = run("bench", "--quick", "--json", folder / "bench.json", "--markdown", page)
    assert status == 0
    document = json.loads((folder / "bench.json").read_text())
    assert (document["format"], document["version"]) == ("atg-fg/bench", 1)
    assert set(document) == {
        *(
            "format",
            "version",
            "parameters",
            "machine",
            "trials",
            "floor",
            "equal_matches",
            "table1",
            "targets",
            "against",
            "peak_memory",
            "worker_start",
        )
    }
    assert platform.node() not in json.dumps(document).split('"')
    (size,) = document["trials"]
    assert size["remembered"] == 10
    names = [row["name"] for row in size["contestants"]]
    assert {"bayes-filter", "gtsam", "learned-structure", "JAX", "pyAgrum", "pgmpy", "pymdp"} <= set(names)
    for row in size["contestants"]:
        assert ("left_out" in row) != ("rounds" in row), row
        if "rounds" in row:
            for quantity, seconds in row["rounds"].items():
                assert len(seconds) == size["n_rounds"]
                assert min(seconds) > 0
                assert len(row["ratio"][quantity]["quartiles"]) == 2
            assert row.get("agreement") is None or row["agreement"]["agrees"] in (True, None)
    assert [row["engine"] for row in document["table1"]["engines"]] == ["bayes-filter", "gtsam"]
    assert len(document["targets"]) == 21
    assert document["floor"][0]["milliseconds"]["floor"] > 0
    assert set(document["worker_start"]["seconds"]) == {"command", "serial", "added", "first", "later"}
    assert "One decision" in output

    written = page.read_text()
    assert written.startswith(f"# Title\n{BEGIN}\n")
    assert written.endswith(f"{END}\nend\n")
    assert "old" not in written
    assert document["machine"]["processor"] in written
    # The page can be made again from the file, and then nothing is measured.
    page.write_text(f"{BEGIN}{END}")
    status, _, error = run("bench", "--from", folder / "bench.json", "--markdown", page)
    assert (status, error) == (0, "")
    assert page.read_text().split(BEGIN)[1].split(END)[0] == written.split(BEGIN)[1].split(END)[0]


def test_what_cannot_be_is_refused_before_anything_is_measured(refused, folder, tmp_path):
    bare = tmp_path / "bare.md"
    bare.write_text("nothing to fill\n")
    assert "expected a line <!-- atg-fg bench: begin -->" in refused("bench", "--markdown", bare)
    assert "--sizes: '0'; expected whole numbers" in refused("bench", "--sizes", "10,0")
    assert "'--rounds': Input should be greater than or equal to 1" in refused("bench", "--rounds", 0)
    assert "cannot be written" in refused("bench", "--json", tmp_path / "no" / "file.json")
    other = tmp_path / "other.json"
    for text, said in (("[1]", "not written by atg-fg bench"), ("{", "not JSON"), ("{}", "not written by")):
        other.write_text(text)
        assert said in refused("bench", "--from", other)
    other.write_text('{"format": "atg-fg/bench", "version": 1}')
    assert "not as atg-fg bench wrote it" in refused("bench", "--from", other)


@pytest.mark.parametrize("module", ["sim.cli", "benchmarks.cli"])
def test_what_adds_commands_can_be_imported_by_itself(module):
    done = subprocess.run([sys.executable, "-c", f"import {module}"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
