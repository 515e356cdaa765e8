import hypothesis
import pytest

from tests import dask_cluster


def pytest_configure(config):
    """Try some examples, and where slow tests run, many.

    They are the same on every run: a test that passed yesterday fails today only if the code has changed.
    """
    n_examples = 12 if "not slow" in config.option.markexpr else 60
    hypothesis.settings.register_profile(
        "atg-fg", derandomize=True, deadline=None, database=None, max_examples=n_examples
    )
    hypothesis.settings.load_profile("atg-fg")


@pytest.fixture(scope="session")
def dask_address(tmp_path_factory):
    """A scheduler with two workers."""
    pytest.importorskip("distributed")
    folder = tmp_path_factory.mktemp("dask")
    with dask_cluster.scheduler(folder) as (_, address), dask_cluster.workers(address, folder):
        dask_cluster.wait_for(lambda: dask_cluster.n_workers(address) == 2)
        yield address
