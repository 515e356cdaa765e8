"""Ctrl-C that meets a process which is just being begun: answered when it has all that it needs, and not before."""

import multiprocessing.util
import os
import signal
import socket
import threading
from contextlib import closing

import pytest

from atg_fg.experiments.executors import fork_server
from atg_fg.experiments.executors.processes import WorkerProcesses
from tests import pieces
from tests.dask_cluster import wait_for
from tests.process_groups import interruptions_noted

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")


@pytest.fixture(params=["server", "spawned"])
def interrupted_spawning(request, monkeypatch, server_loads_little):
    """Let Ctrl-C come when a process has been begun and told nothing yet, to whichever thread takes it.

    That is the server that forks workers, or a worker where there can be no server.
    """
    if request.param == "spawned":
        monkeypatch.setattr(fork_server, "is_possible", lambda: False)
    elif not fork_server.is_possible():
        pytest.skip("no server is possible")
    mark = {"server": b"forkserver", "spawned": b"spawn_main"}[request.param]
    asleep = threading.Event()
    thread = threading.Thread(target=asleep.wait)
    thread.start()
    noticed, tell = socket.socketpair()
    tell.setblocking(False)
    before = signal.set_wakeup_fd(tell.fileno())
    spawn, begun = multiprocessing.util.spawnv_passfds, []

    def spawn_interrupted(path, arguments, descriptors):
        process = spawn(path, arguments, descriptors)
        if any(mark in os.fsencode(each) for each in arguments):
            begun.append(process)
            # One alone: another could come after the test. It is blocked in this thread, so another one takes it.
            if len(begun) == 1:
                signal.pthread_kill(thread.ident, signal.SIGINT)
                noticed.recv(1)  # the other thread may be slow to take it, and the test would be over by then
        return process

    monkeypatch.setattr(multiprocessing.util, "spawnv_passfds", spawn_interrupted)
    yield begun
    signal.set_wakeup_fd(before)
    asleep.set()
    thread.join()
    for end in (noticed, tell):
        end.close()


def has_ended(process):
    try:
        return os.waitpid(process, os.WNOHANG)[0] == process
    except ChildProcessError:
        return True  # and somebody has waited for it


def test_an_interruption_waits_until_a_worker_has_been_told_what_to_do(interrupted_spawning, capfd):
    handler = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt), closing(WorkerProcesses(2)) as workers:
            workers.submit(pieces.square, 3)
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    finally:
        signal.signal(signal.SIGINT, handler)
    wait_for(lambda: all(map(has_ended, interrupted_spawning)))
    assert capfd.readouterr() == ("", "")


@pytest.mark.usefixtures("interrupted_spawning")
def test_the_worker_is_as_good_as_others_to_who_goes_on_after_an_interruption(capfd):
    with interruptions_noted() as met, closing(WorkerProcesses(1)) as workers:
        assert workers.result(workers.submit(pieces.square, 3)) == 9
    assert met
    assert capfd.readouterr() == ("", "")
