"""Workers that a server forks: what they share with each other, and what they do not."""

import os
import signal
import subprocess
import sys
from contextlib import closing

import pytest

from atg_fg.experiments.executors import fork_server
from atg_fg.experiments.executors.base import run_pieces
from atg_fg.experiments.executors.processes import WorkerProcesses
from tests import dask_cluster, pieces
from tests.process_groups import interruptions_noted, nobody_left

pytestmark = pytest.mark.skipif(not fork_server.is_possible(), reason="no server is possible")


def server_of_workers():
    (server,) = set(run_pieces(pieces.parent, range(4), jobs=2))
    return server


def test_it_has_one_thread_and_all_loaded_that_trials_need():
    assert run_pieces(pieces.threads_of_parent, range(2), jobs=2) == [1, 1]
    loaded = ["atg_fg.experiments.table1", "numba.np.arraymath"]
    assert run_pieces(pieces.is_loaded, loaded, jobs=2) == [True, True]


def test_one_serves_all_campaigns_of_a_process():
    assert server_of_workers() == server_of_workers()


@pytest.mark.usefixtures("server_loads_little")
@pytest.mark.parametrize("change", ["environment", "path"])
def test_another_one_is_begun_where_it_would_load_something_else(change, monkeypatch, tmp_path):
    before = server_of_workers()
    if change == "environment":
        monkeypatch.setenv("ATG_FG_KERNELS", "0")
    else:
        monkeypatch.syspath_prepend(tmp_path)
    assert server_of_workers() != before
    with pytest.raises(ProcessLookupError):
        os.kill(before, 0)


@pytest.mark.usefixtures("server_loads_little")
def test_workers_have_the_environment_of_who_began_them(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", "/somewhere")
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    for environment in run_pieces(pieces.environment, range(2), jobs=2):
        assert {**environment, **os.environ} == environment
        assert "PYTHONSAFEPATH" not in environment


def test_it_finds_the_library_where_this_process_does(monkeypatch, tmp_path):
    (tmp_path / "atg_fg").mkdir()
    (tmp_path / "atg_fg" / "__init__.py").write_text("raise RuntimeError")
    monkeypatch.chdir(tmp_path)
    assert run_pieces(pieces.is_loaded, ["numba.np.arraymath"] * 2, jobs=2) == [True, True]


def test_workers_have_global_random_numbers_of_their_own():
    assert len(set(run_pieces(pieces.global_random_numbers, range(2), jobs=2))) == 2


@pytest.mark.parametrize("threads", ["OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"])
def test_there_is_none_where_its_libraries_may_have_threads(threads, monkeypatch):
    monkeypatch.setenv(threads, "2")
    assert run_pieces(pieces.parent, range(2), jobs=2) == [os.getpid()] * 2


@pytest.mark.usefixtures("server_loads_little")
def test_one_that_is_killed_costs_its_workers_pieces_and_another_is_begun(tmp_path):
    work = [(str(tmp_path), number) for number in range(3)]
    assert run_pieces(pieces.its_server_dies_once, work, jobs=2) == [0, 1, 2]
    assert pieces.times_begun(tmp_path, 1) == 2


def test_workers_are_spawned_where_it_does_not_answer(monkeypatch):
    monkeypatch.setattr(fork_server.forkserver.ForkServer, "connect_to_new_process", refuse)
    assert run_pieces(pieces.parent, range(2), jobs=2) == [os.getpid()] * 2


def refuse(_server, _descriptors):
    raise ConnectionRefusedError


@pytest.mark.usefixtures("server_loads_little")
class TestCtrlCWhileItLoads:
    """Whoever waits for a worker waits for the server, which may compile loops for a minute."""

    @pytest.fixture(autouse=True)
    def interrupted(self, monkeypatch):
        fork = fork_server.WorkerServer.fork

        def fork_interrupted(*arguments):
            signal.raise_signal(signal.SIGINT)
            return fork(*arguments)

        monkeypatch.setattr(fork_server.WorkerServer, "fork", fork_interrupted)

    def test_it_is_answered_at_once(self, capfd):
        handler = signal.signal(signal.SIGINT, signal.default_int_handler)
        try:
            with pytest.raises(KeyboardInterrupt), closing(WorkerProcesses(1)) as workers:
                workers.submit(pieces.square, 3)
        finally:
            signal.signal(signal.SIGINT, handler)
        assert capfd.readouterr() == ("", "")

    def test_who_goes_on_after_it_gets_workers_all_the_same(self):
        with interruptions_noted() as met, closing(WorkerProcesses(1)) as workers:
            assert workers.result(workers.submit(pieces.square, 3)) == 9
        assert met


SCRIPT = """
from atg_fg.experiments.executors.base import run_pieces
from atg_fg.experiments.executors.fork_server import begin_early

def own(number):
    return number + 1

if __name__ == "__main__":
    begin_early()
    print({})
"""


@pytest.mark.parametrize("campaign", ["run_pieces(own, range(3), jobs=2)", "'ends before there is one'"])
def test_a_script_has_functions_of_its_own_and_leaves_no_process(campaign, tmp_path):
    (tmp_path / "script.py").write_text(SCRIPT.format(campaign))
    process = subprocess.Popen(
        [sys.executable, "-W", "error", tmp_path / "script.py"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
        env={**os.environ, "PYTHONPATH": str(dask_cluster.ROOT)},
    )  # fmt: skip
    output, error = process.communicate(timeout=120)
    assert (process.returncode, error) == (0, "")
    assert output == ("[1, 2, 3]\n" if "own" in campaign else "ends before there is one\n")
    dask_cluster.wait_for(lambda: nobody_left(process.pid))
