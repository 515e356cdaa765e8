import os
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError, MissingDependencyError, WorkerLostError
from atg_fg.experiments.executors import base as executors
from atg_fg.experiments.executors import dask_cluster as cluster
from atg_fg.experiments.executors.base import check_executor, run_pieces
from tests import dask_cluster, pieces


@pytest.fixture(params=["process", "thread", "dask"])
def executor(request):
    return request.getfixturevalue("dask_address") if request.param == "dask" else request.param


@pytest.fixture(params=["process", pytest.param("dask", marks=pytest.mark.slow)])
def mortal(request):
    """An executor whose workers are processes that can be killed."""
    return request.getfixturevalue("dask_address") if request.param == "dask" else request.param


def test_results_come_in_the_order_of_the_pieces(executor):
    assert run_pieces(pieces.square, range(7), executor, jobs=2) == [number**2 for number in range(7)]


def test_results_are_told_as_soon_as_they_are_there(executor, tmp_path):
    told = []
    work = [(str(tmp_path), number) for number in range(4)]
    results = run_pieces(pieces.waits_for_the_first, work, executor, 2, lambda *each: told.append(each))
    assert results == [0, 1, 2, 3]
    assert sorted(told) == [(number, number) for number in range(4)]
    assert told[0] != (0, 0)


@pytest.mark.parametrize(("executor", "jobs"), [("process", 2), ("thread", 2), ("process", 1)])
def test_the_steps_of_all_pieces_are_told(executor, jobs):
    told = []
    assert run_pieces(pieces.steps, [4, 0, 3, 5], executor, jobs, on_steps=told.append) == [4, 0, 3, 5]
    assert sum(told) == 12
    pieces.steps(2)  # outside of a piece nobody is told
    assert sum(told) == 12


@pytest.mark.parametrize("executor", ["process", "thread"])
def test_steps_are_told_before_a_piece_has_ended(executor, tmp_path):
    told = []

    def tell(number):
        told.append(number)
        (tmp_path / "told").touch()

    assert run_pieces(pieces.slow_steps, [(str(tmp_path / "told"),)] * 2, executor, 2, on_steps=tell) == [True, True]
    assert sum(told) == 6


def test_what_a_piece_raises_is_passed_on(executor):
    with pytest.raises(ValueError, match="three"):
        run_pieces(pieces.refuses_three, range(100), executor, jobs=2)


def test_nothing_to_do_needs_no_workers():
    assert run_pieces(pieces.square, [], "dask://nowhere:1", jobs=2) == []


def test_one_job_is_done_here():
    assert run_pieces(lambda number: (number, os.getpid()), [5], jobs=4) == [(5, os.getpid())]
    assert run_pieces(lambda number: number + 1, [1, 2], jobs=1) == [2, 3]


def test_processes_and_threads_are_what_they_are_called():
    own = os.getpid()
    threads, processes = (run_pieces(pieces.thread_and_process, range(6), name, 2) for name in ("thread", "process"))
    assert {process for _, process in threads} == {own}
    assert len({thread for thread, _ in threads}) == 2
    assert own not in {process for _, process in processes}
    assert len({process for _, process in processes}) == 2


def test_a_killed_worker_loses_its_piece_alone_and_that_is_run_again(mortal, tmp_path):
    work = [(str(tmp_path), number) for number in range(4)]
    assert run_pieces(pieces.one_dies_once, work, mortal, jobs=2) == [0, 1, 2, 3]
    assert [pieces.times_begun(tmp_path, number) for number in range(4)] == [1, 2, 1, 1]


def test_a_piece_that_kills_each_worker_is_given_up(mortal, tmp_path):
    with pytest.raises(WorkerLostError, match="piece 2 of 2: "):
        run_pieces(pieces.one_always_dies, [(str(tmp_path), number) for number in range(2)], mortal, jobs=2)
    # dask's own bound is to allow three failures.
    assert pieces.times_begun(tmp_path, 1) == (3 if mortal == "process" else 4)


@pytest.mark.usefixtures("server_loads_little")
def test_processes_have_one_thread_for_linear_algebra_unless_the_user_says_otherwise(monkeypatch):
    monkeypatch.delenv("OMP_NUM_THREADS", raising=False)
    monkeypatch.setenv("MKL_NUM_THREADS", "3")
    before = dict(os.environ)
    assert run_pieces(pieces.threads_of_linear_algebra, range(2), jobs=2) == [("1", "3")] * 2
    assert dict(os.environ) == before


def test_threads_do_not_share_settings_of_numpy():
    def divide(number):
        return float(np.float64(number) / np.float64(0.0))

    with np.errstate(divide="ignore"):
        assert run_pieces(divide, [1.0], jobs=1) == [np.inf]
        with pytest.raises(RuntimeWarning):
            run_pieces(divide, [1.0, 2.0], "thread", jobs=2)


@pytest.mark.parametrize("address", ["magic", "", "dask", "dask://", "dask://host", "dask://host:port", "dask://:8786"])
@pytest.mark.parametrize("rest", ["", "/status"])
def test_other_executors_are_refused(address, rest):
    with pytest.raises(InvalidInputError, match=r"--executor: .*; expected process, thread or dask://host:port"):
        check_executor(address + rest, "--executor")


@pytest.mark.parametrize("address", ["process", "thread", "dask://host:8786", "dask://10.0.0.1:1", "dask://[::1]:8786"])
def test_executors_are_these(address):
    check_executor(address)
    assert executors.is_cluster(address) == address.startswith("dask")


class TestCluster:
    def test_a_scheduler_that_does_not_answer_is_one_clear_error(self, monkeypatch):
        pytest.importorskip("distributed")
        monkeypatch.setattr(cluster, "PATIENCE", 0.2)
        with pytest.raises(InvalidInputError, match=r"dask://127\.0\.0\.1:1'?: no scheduler answered within 0\.2 s"):
            run_pieces(pieces.square, [1], "dask://127.0.0.1:1")

    def test_a_scheduler_without_workers_is_one_clear_error(self, monkeypatch, tmp_path):
        pytest.importorskip("distributed")
        with dask_cluster.scheduler(tmp_path) as (_, address):
            monkeypatch.setattr(cluster, "PATIENCE", 2)
            with pytest.raises(InvalidInputError, match="has no workers; expected some, each begun with: dask worker"):
                run_pieces(pieces.square, [1], address)

    def test_workers_with_another_version_are_refused(self, dask_address, monkeypatch):
        monkeypatch.setattr(cluster, "__version__", "0.0.0")
        with pytest.raises(InvalidInputError, match=r"has atg-fg .*; expected 0\.0\.0"):
            run_pieces(pieces.square, [1], dask_address)

    def test_without_dask_the_extra_that_brings_it_is_named(self, monkeypatch):
        monkeypatch.setitem(sys.modules, "distributed", None)
        with pytest.raises(MissingDependencyError, match=r"dask is not installed.*atg-fg\[cluster\]"):
            run_pieces(pieces.square, [1], "dask://127.0.0.1:1")

    @pytest.mark.slow
    def test_a_scheduler_that_dies_is_one_clear_error(self, tmp_path, capfd):
        pytest.importorskip("distributed")
        with dask_cluster.scheduler(tmp_path) as (process, address), dask_cluster.workers(address, tmp_path, 1):
            dask_cluster.wait_for_workers(address, 1)
            capfd.readouterr()
            with ThreadPoolExecutor(1) as pool:
                pool.submit(kill_when_begun, process, tmp_path)
                # The other pieces that it waits for never come.
                with pytest.raises(WorkerLostError, match="the scheduler is gone"):
                    run_pieces(pieces.waits_for_the_first, [(str(tmp_path), 0)], address)
        assert capfd.readouterr() == ("", "")


def kill_when_begun(process, folder):
    dask_cluster.wait_for(lambda: pieces.times_begun(folder, 0))
    process.kill()
