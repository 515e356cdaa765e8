import gc
import os
from pathlib import Path

import hypothesis
import pytest

from tests import dask_cluster

#: Files that take longest, in the order in which workers begin them, before all others: so none is left with a long one
#: at the end. Where nothing is compiled yet, the first one compiles most loops of learning for a minute. Meanwhile
#: another worker goes through files that use none of them, so that the two do not compile the same.
LONGEST = (
    "engines/test_learned_structure.py",
    "cli/test_endings.py",
    "experiments/executors/test_base.py",
    "sim/worlds/test_stations_world.py",
    "sim/worlds/test_robonaut_world.py",
    "sim/worlds/test_rendered_world.py",
    "report/test_browser.py",
    "cli/test_executors.py",
    "sim/manipulation/test_waypoints.py",
    "core/test_object_sense.py",
    "sim/worlds/test_picture_box_world.py",
    "learning/test_learner.py",
    "report/test_every_record.py",
    "unchanged/test_unchanged.py",
    "cli/test_live.py",
    "cli/test_recordings.py",
    "test_torture.py",
    "test_planted_faults.py",
    "test_tour.py",
    "test_notebooks.py",
    "test_guides.py",
    "test_five_minutes.py",
    "sim/test_reliability.py",
)


def pytest_configure(config):
    """Try some examples, and where slow tests run, many.

    They are the same on every run: a test that passed yesterday fails today only if the code has changed.
    """
    n_examples = 12 if "not slow" in config.option.markexpr else 60
    hypothesis.settings.register_profile(
        "atg-fg", derandomize=True, deadline=None, database=None, max_examples=n_examples
    )
    hypothesis.settings.load_profile("atg-fg")


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    """Let every other worker collect from the end: no two then compile the same files where none is compiled yet."""
    report = yield
    if isinstance(collector, pytest.Directory) and os.environ.get("PYTEST_XDIST_WORKER", "")[-1:] in tuple("13579"):
        report.result.reverse()
    return report


def pytest_collection_modifyitems(items):
    """Put the files that take longest first, and the others in their order."""
    places = {Path(__file__).parent / name: place for place, name in enumerate(LONGEST)}
    assert all(path.is_file() for path in places)
    items.sort(key=lambda item: (places.get(item.path, len(places)), item.path))


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Let nothing look for garbage in what is imported and collected, now or later: it is a lot, and it all stays."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.freeze()
        gc.enable()


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call():
    """Take the name of the test out of the environment: what forks workers for one test is then of use to the next."""
    os.environ.pop("PYTEST_CURRENT_TEST", None)


@pytest.fixture(scope="module")
def dask_address(tmp_path_factory, request):
    """A scheduler with two workers, which end with the file; in quick tests, with one of two threads."""
    pytest.importorskip("distributed")
    folder, is_quick = tmp_path_factory.mktemp("dask"), "not slow" in request.config.option.markexpr
    with dask_cluster.scheduler(folder) as (_, address), dask_cluster.workers(address, folder, threads=is_quick):
        dask_cluster.wait_for_workers(address, 1 if is_quick else 2)
        yield address
