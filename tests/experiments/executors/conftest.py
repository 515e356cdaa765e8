import pytest

from atg_fg.experiments.executors import fork_server


@pytest.fixture
def server_loads_little(monkeypatch):
    """Begin what forks workers anew, with no more loaded than pieces need: nothing else of it depends on that."""
    fork_server._stop_idle()
    monkeypatch.setattr(fork_server, "PRELOADED", "tests.pieces")
    yield
    fork_server._stop_idle()
