"""Many trials at once on the command line: the same bytes anywhere, and after workers or the command were killed."""

import os
import signal
import subprocess
import sys
from functools import cache

import pytest

from atg_fg import cli
from atg_fg.storage.trial_log import read_log
from tests.dask_cluster import ROOT, wait_for
from tests.process_groups import children_of, nobody_left

slow = pytest.mark.slow
#: Two tests that are soon over.
SHORT_TABLE1 = ["table1", "--engine", "bayes-filter", "--tests", "2", "--trials", "8", "--actions", "4"]
#: Two tests that take long enough to be met in the middle, even on a quick machine.
TABLE1 = ["table1", "--engine", "gtsam", "--tests", "2", "--trials", "20", "--actions", "4"]
FIGURE3 = ["figure3", "--actions", "2:5", "--tests", "3", "--trials", "40"]
ABLATION = ["ablation", "--variants", "paper;learned", "--noises", "ideal", "--actions", "2,3", "--tests", "2"]
ABLATION += ["--trials", "5"]
GOAL = ["goal", "--engine", "bayes-filter", "--memory-cubes", "6", "--learning-actions", "8", "--trials", "3"]
RECORDED = {"short table1": SHORT_TABLE1, "table1": TABLE1, "goal": GOAL}
LOGGED = {"figure3": FIGURE3, "ablation": ABLATION}


def begin(*arguments):
    """Begin the command in a process group of its own, as a terminal does, which leaves SIGINT to it."""
    code = "from atg_fg.cli import main; main()"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(
        [sys.executable, "-c", code, *map(str, arguments)],
        env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
        # Whoever runs the tests in the background may have told them to ignore it, and children inherit that.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip


def finish(process):
    output, error = process.communicate(timeout=300)
    return process.returncode, output, error


def workers_of(process):
    """Return the ids of the workers of a process: what its children, one of which forks, have for children (Linux)."""
    return [worker for child in children_of(process.pid) for worker in children_of(child)]


def some_trials(folder):
    return any(len(read_log(path)[1]) >= 2 for path in folder.glob("test-*.jsonl.gz"))


def some_lines(log):
    return log.exists() and len(log.read_bytes().splitlines()) >= 3


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture(scope="module")
def serial(tmp_path_factory):
    """What a command comes to, one piece after the other: its JSON, and its records."""
    folder = tmp_path_factory.mktemp("serial")

    @cache
    def files_of(name):
        command = {**RECORDED, **LOGGED}[name]
        kept = ["--records", folder / name] if name in RECORDED else []
        arguments = [*command, "--jobs", "1", "--json", folder / f"{name}.json", *kept]
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(sys, "argv", ["atg-fg", *map(str, arguments)])
            with pytest.raises(SystemExit, match="0"):
                cli.main()
        return (folder / f"{name}.json").read_bytes(), contents(folder / name) if kept else None

    return files_of


def where(name, request):
    return (
        ["--executor", request.getfixturevalue("dask_address")] if name == "dask" else ["--executor", name, "--jobs", 2]
    )


@pytest.mark.parametrize(
    ("name", "executor"),
    [
        *(("short table1", executor) for executor in ("process", "thread")),
        pytest.param("short table1", "dask", marks=slow),
        pytest.param("goal", "process", marks=slow),
        pytest.param("figure3", "dask", marks=slow),
        pytest.param("ablation", "thread", marks=slow),
    ],
)
def test_the_result_is_that_of_a_serial_run_byte_for_byte(name, executor, serial, run, tmp_path, request):
    kept = ["--records", tmp_path / "kept"] if name in RECORDED else ["--log", tmp_path / "kept"]
    command = {**RECORDED, **LOGGED}[name]
    status, _, error = run(*command, *where(executor, request), *kept, "--json", tmp_path / "json")
    assert (status, error) == (0, "")
    json, records = serial(name)
    assert (tmp_path / "json").read_bytes() == json
    assert records is None or contents(tmp_path / "kept") == records


@pytest.mark.parametrize("executor", ["process", pytest.param("thread", marks=slow), pytest.param("dask", marks=slow)])
def test_ctrl_c_leaves_what_is_finished_and_resume_goes_on(executor, serial, tmp_path, request):
    records = tmp_path / "records"
    command = [*TABLE1, *where(executor, request), "--records", records, "--json", tmp_path / "json"]
    process = begin(*command)
    wait_for(lambda: some_trials(records))
    os.killpg(process.pid, signal.SIGINT)
    assert finish(process) == (130, "", "")
    wait_for(lambda: nobody_left(process.pid))
    assert not (tmp_path / "json").exists()
    status, _, error = finish(begin(*command, "--resume"))
    assert (status, error) == (0, "")
    assert ((tmp_path / "json").read_bytes(), contents(records)) == serial("table1")


@slow
def test_tests_in_a_log_outlive_ctrl_c(serial, tmp_path):
    log = tmp_path / "log.jsonl"
    command = [*FIGURE3, "--jobs", 2, "--log", log, "--json", tmp_path / "json"]
    process = begin(*command)
    wait_for(lambda: some_lines(log))
    os.killpg(process.pid, signal.SIGINT)
    assert finish(process) == (130, "", "")
    wait_for(lambda: nobody_left(process.pid))
    kept = log.read_bytes()
    assert len(kept.splitlines()) < 25
    status, _, error = finish(begin(*command))
    assert (status, error) == (0, "")
    assert log.read_bytes().startswith(kept)
    assert len(log.read_bytes().splitlines()) == 25
    assert (tmp_path / "json").read_bytes() == serial("figure3")[0]


@pytest.mark.skipif(sys.platform != "linux", reason="finds processes in /proc")
class TestKilled:
    @slow
    def test_a_worker_that_is_killed_changes_nothing(self, serial, tmp_path):
        records = tmp_path / "records"
        process = begin(*TABLE1, "--jobs", 2, "--records", records, "--json", tmp_path / "json")
        wait_for(lambda: some_trials(records))
        os.kill(workers_of(process)[0], signal.SIGKILL)
        status, _, error = finish(process)
        assert (status, error) == (0, "")
        assert ((tmp_path / "json").read_bytes(), contents(records)) == serial("table1")

    @slow
    def test_workers_leave_with_a_command_that_is_killed(self, serial, tmp_path):
        records = tmp_path / "records"
        command = [*TABLE1, "--jobs", 2, "--records", records, "--json", tmp_path / "json"]
        process = begin(*command)
        wait_for(lambda: some_trials(records))
        assert len(workers_of(process)) == 2
        process.kill()
        process.communicate()
        wait_for(lambda: nobody_left(process.pid))
        assert finish(begin(*command, "--resume"))[0] == 0
        assert ((tmp_path / "json").read_bytes(), contents(records)) == serial("table1")


@pytest.mark.parametrize("command", ["table1", "figure3", "ablation", "goal"])
def test_bad_executors_are_one_line(command, refused):
    assert "--executor: 'magic'; expected process, thread or dask://host:port" in refused(
        command, "--executor", "magic"
    )
    both = ["--executor", "dask://host:1", "--jobs", "2"]
    assert "--jobs: 2; expected none with --executor dask://host:1" in refused(command, *both)


def test_without_dask_the_line_says_which_extra_to_install(refused, monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    assert 'pip install "atg-fg[cluster]"' in refused("table1", "--executor", "dask://localhost:1")


def test_the_log_of_other_tests_is_refused(run, refused, tmp_path):
    command = ["figure3", "--actions", "2", "--tests", "1", "--trials", "2", "--jobs", "1", "--log", tmp_path / "log"]
    assert run(*command)[0] == 0
    assert "; expected the log of a Figure 3 of {" in refused(*command, "--slip", "0.1")
