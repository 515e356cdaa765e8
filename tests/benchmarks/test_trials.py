import math

import pytest

from atg_fg.engines import ENGINES
from benchmarks import peers, trials
from benchmarks.contestants import REFERENCE, NaiveGraphs, agreement
from benchmarks.memories import course_for, remembered
from benchmarks.trials import Sizes, TrialPlan, contestants


class CountingClock:
    """A clock that moves by one second at each look at it."""

    def __init__(self):
        self.now = 0

    def __call__(self):
        self.now += 1
        return float(self.now)


@pytest.fixture
def no_peers(monkeypatch):
    """Leave a single peer, which is not installed."""
    monkeypatch.setattr(trials, "PEERS", {"other": ()})
    monkeypatch.setitem(peers.PEERS, "other", ("other", "Other", "no_such_library"))


def row(measured, name, preset):
    (found,) = [each for each in measured["contestants"] if (each["name"], each["preset"]) == (name, preset)]
    return found


def test_each_is_held_against_the_reference_with_its_preset_round_by_round(no_peers):
    measured = Sizes(TrialPlan(n_actions=2, most_seconds=1e9), CountingClock()).measure(remembered(3), 2)
    assert (measured["remembered"], measured["n_rounds"]) == (3, 2)
    # Two readings of this clock enclose a step or a decision; one a call is all that anything takes.
    reference = row(measured, REFERENCE, "paper")
    assert reference["rounds"]["decision"] == [1.0, 1.0]
    assert reference["rounds"]["trial"] == [7.0, 7.0]
    assert reference["milliseconds"]["decision"] == {"median": 1000.0, "quartiles": [1000.0, 1000.0]}
    assert reference["agreement"] is None
    naive = row(measured, NaiveGraphs.name, "paper")
    # One second for 2 of 396 graphs.
    assert naive["rounds"] == {"decision": [198.0, 198.0]}
    assert naive["ratio"] == {"decision": {"median": 198.0, "quartiles": [198.0, 198.0]}}
    assert "2 of 396 graphs" in naive["remark"]


def test_exact_engines_agree_and_a_library_that_is_missing_is_a_row(no_peers):
    measured = Sizes(TrialPlan(n_actions=2, most_seconds=1e9), CountingClock()).measure(remembered(3), 1)
    for preset in ("paper", "default"):
        found = row(measured, "gtsam", preset)["agreement"]
        assert found["agrees"] is True
        assert found["identity"] < 1e-12 > found["expected_entropy"]
    assert row(measured, "learned-structure", "learned")["agreement"] is None
    assert row(measured, "other", "paper")["left_out"].startswith("not installed")
    assert "rounds" not in row(measured, "other", "paper")


def test_what_would_take_too_long_is_left_out_with_the_reason_but_never_the_reference(no_peers, monkeypatch):
    monkeypatch.setattr(trials, "GROWING", 2)
    sizes = Sizes(TrialPlan(n_actions=2, most_seconds=8), CountingClock())
    sizes.measure(remembered(2), 1)
    measured = sizes.measure(remembered(4), 1)
    # A trial took 7 s by this clock, so twice as many objects would take 14.
    reason = "a trial would take 14 s, as it took 7 s at 2; the limit is 8 s"
    assert row(measured, "gtsam", "paper")["left_out"] == reason
    assert "rounds" in row(measured, REFERENCE, "paper")


def test_nothing_is_concluded_from_a_small_memory(no_peers):
    sizes = Sizes(TrialPlan(n_actions=2, most_seconds=8), CountingClock())
    sizes.measure(remembered(2), 1)
    assert "rounds" in row(sizes.measure(remembered(4), 1), "gtsam", "paper")


def test_tables_that_are_too_large_are_left_out(monkeypatch):
    memory = remembered(3)
    made = {name: make for name, _, make in contestants(memory, most_bytes=1e4)}
    with pytest.raises(trials.LeftOutError, match=r"its dense tables take 0\.\d GB; the limit is 1e-05 GB"):
        made["pyAgrum"]()


def test_an_engine_that_is_not_registered_is_no_contestant(monkeypatch):
    monkeypatch.setattr(trials, "ENGINE_PRESETS", (("no-such-engine", ("paper",)), ("gtsam", ("paper",))))
    names = [name for name, _, _ in contestants(remembered(1), math.inf)]
    assert names == ["gtsam", *peers.PEERS]


def test_presets_of_the_contestants_are_known_to_their_engines():
    for name, presets in trials.ENGINE_PRESETS:
        if name in ENGINES:
            assert ("learned" in presets) == ENGINES[name].knows_structure


def test_what_differs_is_not_said_to_agree():
    few, course = remembered(3), course_for(remembered(3), 2)
    makers = {(name, preset): make for name, preset, make in contestants(few, math.inf)}
    one, other = makers["gtsam", "paper"](), makers[REFERENCE, "default"]()
    found = agreement(one, other, course)
    assert found["agrees"] is False
    assert found["identity"] > 1e-6
