import pytest

from benchmarks.contestants import NaiveGraphs
from benchmarks.targets import (
    TARGETS,
    Target,
    best_peer,
    growth,
    in_floors,
    milliseconds,
    naive_over_gtsam,
    peak_memory,
    table1_seconds,
    worker_start,
)


def timed(name, preset, seconds):
    return {"name": name, "preset": preset, "rounds": {"decision": seconds}}


@pytest.fixture
def document():
    rows = [
        timed("bayes-filter", "paper", [1e-3, 2e-3, 1e-3]),
        timed("gtsam", "paper", [10e-3, 40e-3, 20e-3]),
        timed("JAX", "paper", [4e-3, 8e-3, 4e-3]),
        timed("pgmpy", "paper", [7e-3, 14e-3, 7e-3]),
        timed(NaiveGraphs.name, "paper", [50.0, 400.0, 200.0]),
        {"name": "pymdp", "preset": "paper", "left_out": "not installed"},
    ]
    return {
        "trials": [{"remembered": 100, "contestants": rows}],
        "floor": [{"remembered": 100, "milliseconds": {"floor": 0.2}}],
        "peak_memory": {"remembered": 100_000, "bytes": 5e8},
        "worker_start": {"seconds": {"added": {"median": 0.7}}},
        "table1": {"trials": 100, "engines": [{"engine": "gtsam", "seconds": {"median": 30.0}}]},
        "equal_matches": {"sizes": [100, 100_000], "ratio": {"decision": {"median": 1.25}}},
    }


def test_figures_are_medians_and_ratios_of_rounds(document):
    assert milliseconds(100, "gtsam", "paper")(document) == 20
    assert naive_over_gtsam(document) == 10_000
    assert best_peer(100)(document) == 4
    assert in_floors(100)(document) == 5
    assert peak_memory(100_000)(document) == 0.5
    assert worker_start("added")(document) == 0.7
    assert table1_seconds("gtsam")(document) == 30
    assert growth("decision")(document) == 1.25


def test_what_was_not_measured_is_not_said_to_be_met_or_missed(document):
    assert milliseconds(1000, "gtsam", "paper")(document) is None
    assert milliseconds(100, "gtsam", "default")(document) is None
    assert table1_seconds("bayes-filter")(document) is None
    document["equal_matches"]["sizes"] = [10, 20]
    assert growth("decision")(document) is None
    document["table1"]["trials"] = 5
    assert table1_seconds("gtsam")(document) is None
    assert worker_start("later")(document) is None
    document["trials"] = []
    document["floor"], document["peak_memory"] = [], None
    del document["worker_start"]
    assert worker_start("added")(document) is None
    assert best_peer(100)(document) is naive_over_gtsam(document) is in_floors(100)(document) is None
    assert peak_memory(100_000)(document) is None
    assert all(target.verdict(document)["met"] is None for target in TARGETS)


@pytest.mark.parametrize(("at_most", "found", "met"), [(True, 2, True), (True, 2.1, False), (False, 1.9, False)])
def test_a_bound_is_the_most_or_the_least(at_most, found, met):
    target = Target("claim", lambda _: found, 2, "ms", at_most=at_most)
    assert target.verdict({}) == {"claim": "claim", "bound": 2, "found": found, "unit": "ms", "met": met}
