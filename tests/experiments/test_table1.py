import gzip
import json
from dataclasses import replace

import gymnasium
import numpy as np
import pytest

from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import PatternAlphabet
from atg_fg.experiments.figure3 import figure3_points
from atg_fg.experiments.scores import TestResult, actions_a_trial, summarise
from atg_fg.experiments.table1 import TestPlan, run_test, run_tests
from atg_fg.storage.presets import preset
from atg_fg.storage.trial_log import read_log
from atg_fg.worlds.finite_objects import FiniteObject, Mechanism, ObjectFamily
from atg_fg.worlds.object_world import ObjectWorld

QUICK = TestPlan(engine="bayes-filter", n_trials=30, n_actions=6)


def test_the_average_of_table_1_is_the_papers():
    rows = [((80, 100), (20, 21), 79), ((79, 100), (25, 27), 77), ((87, 100), (21, 25), 83)]
    rows += [((78, 100), (26, 28), 76), ((84, 100), (24, 27), 81)]
    summary = summarise(
        TestResult(seed, identification, recognition, (success, 100))
        for seed, (identification, recognition, success) in enumerate(rows)
    )
    assert {name: round(100 * rate, 1) for name, rate in summary["average"].items()} == {
        "identification": 81.6,
        "recognition": 90.7,
        "success": 79.2,
    }
    assert [round(bound, 3) for bound in summary["interval95"]["success"]] == [0.754, 0.825]


def test_a_test_counts_what_it_says():
    records = []
    result = run_test(QUICK, 0, on_trial=lambda _, record: records.append(record))
    presented, identified, judged_known = set(), 0, 0
    for record in records:
        truth = record.steps[0].truth["object"]
        identified += record.judged_novel == (truth not in presented)
        judged_known += truth in presented and not record.judged_novel
        presented.add(truth)
    assert len(records) == 30
    assert result.identification == (identified, 30)
    assert result.recognition[1] == judged_known
    n_novel_right = identified - judged_known
    assert result.success == (n_novel_right + result.recognition[0], 30)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_result_for_any_number_of_jobs():
    plans = [(QUICK, seed) for seed in range(3)]
    assert list(run_tests(plans, jobs=1)) == list(run_tests(plans, jobs=2))


def test_every_exact_engine_gives_the_same_test():
    plan = {"n_trials": 12, "n_actions": 4, "parameters": preset("paper")}
    assert run_test(TestPlan(engine="gtsam", **plan), 1) == run_test(TestPlan(engine="bayes-filter", **plan), 1)


def test_a_world_that_shows_nothing_teaches_nothing():
    result = run_test(TestPlan(engine="bayes-filter", world_options={"missing": 1.0}, n_trials=5), 0)
    assert result.recognition == (0, 0)
    assert summarise([result])["average"]["recognition"] is None


def test_learning_within_the_trial_beats_the_literal_model_on_the_same_seeds():
    rates = {}
    for name in ("paper", "default"):
        plan = TestPlan(engine="bayes-filter", parameters=preset(name))
        rates[name] = np.mean([test.success[0] / test.success[1] for test in run_tests([(plan, s) for s in range(3)])])
    assert rates["default"] > rates["paper"] + 0.03


@pytest.mark.slow
def test_the_paper_preset_reproduces_table_1_and_the_default_one_beats_it():
    averages = {}
    for name in ("paper", "default"):
        plan = TestPlan(engine="bayes-filter", parameters=preset(name))
        averages[name] = summarise(run_tests([(plan, seed) for seed in range(40)], jobs=2))["average"]["success"]
    assert 0.754 <= averages["paper"] <= 0.825
    assert averages["default"] >= 0.9


def test_figure_3_has_a_point_for_each_policy_and_number_of_actions():
    done = []
    plan = TestPlan(engine="bayes-filter", n_trials=10)
    points = figure3_points(plan, [2, 4], ("entropy", "random"), range(2), on_trials=done.append)
    assert [(point["actions"], point["policy"]) for point in points] == [
        (2, "entropy"),
        (2, "random"),
        (4, "entropy"),
        (4, "random"),
    ]
    assert sum(done) == 8 * 10
    for point in points:
        assert point["interval95"][0] <= point["success"] <= point["interval95"][1]


@pytest.mark.parametrize("sizes", [{"n_actions": 0}, {"n_trials": 0}, {"n_objects": -1}])
def test_a_plan_of_nothing_is_refused(sizes):
    with pytest.raises(InvalidInputError, match="expected a whole number from 1 to 100000"):
        TestPlan(**sizes)


def test_unknown_names_are_refused_before_any_work():
    with pytest.raises(UnknownNameError, match="engine"):
        TestPlan(engine="magic")
    with pytest.raises(UnknownNameError, match="policy"):
        TestPlan(policy="magic")
    with pytest.raises(UnknownNameError, match="world"):
        run_test(TestPlan(world="magic", parameters=ModelParameters()), 0)
    with pytest.raises(InvalidInputError, match="jobs: 0"):
        run_tests([(QUICK, 0)], jobs=0)


@pytest.fixture
def own_world():
    """A world of the user's own, by its name: two coins of two sides each, that says so itself."""

    def make(**options):
        turn = Mechanism.deterministic([[1], [0]])
        coins = tuple(FiniteObject(turn, ((side,), (side + 1,))) for side in (0, 2))
        return ObjectWorld(ObjectFamily(("turn",), PatternAlphabet(("up",), 4), coins), **options)

    gymnasium.register(id="own/Coins-v0", entry_point=make)
    yield "atg_fg:own/Coins-v0"
    del gymnasium.registry["own/Coins-v0"]


def test_a_world_of_ones_own_says_its_assumptions_or_is_of_arcubes(own_world):
    for world, n_objects, n_aspects in ((own_world, 2, 2), ("atg_fg:atg_fg/ARcube-v0", 50, 24)):
        records = []
        plan = TestPlan(world=world, engine="bayes-filter", n_trials=6, n_actions=2, n_objects=50)
        run_test(plan, 0, on_trial=lambda _, record, found=records: found.append(record))
        assumptions = records[0].assumptions
        assert (assumptions.n_objects, assumptions.n_aspects) == (n_objects, n_aspects)


class TestRecords:
    PLAN = TestPlan(engine="bayes-filter", n_trials=12, n_actions=4, world_options={"missing": 0.1})

    def test_a_test_that_was_cut_off_goes_on_and_comes_to_the_same(self, tmp_path):
        whole = run_test(self.PLAN, 2, tmp_path / "whole")
        run_so_far = []

        def stop(number, record):
            run_so_far.append(number)
            if number == 6:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            run_test(self.PLAN, 2, tmp_path / "cut", on_trial=stop)
        rest = []
        resumed = run_test(self.PLAN, 2, tmp_path / "cut", True, on_trial=lambda number, _: rest.append(number))
        assert run_so_far + rest == list(range(12))
        assert resumed == whole == run_test(self.PLAN, 2)
        name = "test-0002.jsonl.gz"
        assert (tmp_path / "cut" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()

    def test_a_finished_test_is_only_read(self, tmp_path):
        whole = run_test(self.PLAN, 0, tmp_path)
        rest = []
        assert run_test(self.PLAN, 0, tmp_path, True, on_trial=lambda number, _: rest.append(number)) == whole
        assert rest == []

    def test_records_of_another_plan_are_refused(self, tmp_path):
        run_test(self.PLAN, 0, tmp_path)
        with pytest.raises(InvalidInputError, match="expected the trials of"):
            run_test(replace(self.PLAN, n_actions=5), 0, tmp_path, True)
        with pytest.raises(InvalidInputError, match="already there"):
            run_test(self.PLAN, 0, tmp_path)

    @pytest.mark.slow
    def test_each_of_several_processes_keeps_the_records_of_its_tests(self, tmp_path):
        plans = [(self.PLAN, seed) for seed in range(2)]
        results = list(run_tests(plans, 2, tmp_path))
        assert results == [run_test(self.PLAN, seed) for seed in range(2)]
        assert list(run_tests(plans, 1, tmp_path, True)) == results


def test_trials_without_a_verdict_are_counted_and_are_no_success():
    result = run_test(TestPlan(engine="bayes-filter", world_options={"missing": 1.0}, n_trials=5), 0)
    assert (result.identification, result.success, result.undecided, result.lost) == ((0, 5), (0, 5), 5, 0)
    summary = summarise([result])
    assert (summary["undecided"], summary["lost"], summary["tests"][0]["undecided"]) == (5, 0, 5)


class TestSmoothedLearning:
    # Few objects, often met: what was seen in part one time is known from another.
    PLAN = TestPlan(
        engine="bayes-filter",
        smoothed_learning=True,
        world_options={"missing": 0.2},
        n_objects=2,
        n_trials=12,
        n_actions=12,
    )

    def test_it_is_the_same_after_an_interruption(self, tmp_path):
        whole = run_test(self.PLAN, 1, tmp_path)
        assert run_test(self.PLAN, 1, tmp_path, True) == whole == run_test(self.PLAN, 1)

    def test_it_fills_in_what_was_seen_in_part(self, tmp_path):
        run_test(self.PLAN, 1, tmp_path)
        trials = read_log(tmp_path / "test-0001.jsonl.gz")[1]
        filled = [trial for trial in trials if "learned" in trial]
        assert filled
        for trial in filled:
            seen_whole = sum(None not in seen for seen in trial["observed"])
            assert sum(pattern is not None for pattern in trial["learned"]) > seen_whole

    def test_where_everything_is_seen_it_changes_nothing(self):
        plan = replace(self.PLAN, world_options={})
        assert run_test(plan, 1) == run_test(replace(plan, smoothed_learning=False), 1)


def test_records_of_presets_without_structure_keep_their_header(tmp_path):
    plan = replace(QUICK, parameters=preset("paper"), n_trials=1)
    run_test(plan, 0, tmp_path)
    header = json.loads(gzip.decompress((tmp_path / "test-0000.jsonl.gz").read_bytes()).splitlines()[0])
    assert header["parameters"] == {
        "transition_concentration": 1e-8,
        "observation_noise": 1e-8,
        "learn_in_trial": False,
    }


class TestSettled:
    PLAN = replace(QUICK, settled=0.05, n_actions=12)

    def test_trials_that_end_early_are_scored_and_learned_from_like_any_other(self):
        records = []
        result = run_test(self.PLAN, 0, on_trial=lambda _, record: records.append(record))
        assert result.actions == tuple(len(record.actions) for record in records)
        assert min(result.actions) < 12 == max(result.actions)
        assert result.identification[1] == result.success[1] == len(records) == 30
        assert [record.names for record in records[:2]] == [(), ("object-000",)]

    def test_it_is_the_same_after_an_interruption(self, tmp_path):
        whole = run_test(self.PLAN, 1, tmp_path)
        assert run_test(self.PLAN, 1, tmp_path, True) == whole == run_test(self.PLAN, 1)
        trials = read_log(tmp_path / "test-0001.jsonl.gz")[1]
        assert tuple(len(trial["actions"]) for trial in trials) == whole.actions
        assert trials[0]["purpose"] == ["settled"]

    def test_records_of_trials_that_do_not_stop_are_of_another_test(self, tmp_path):
        run_test(replace(self.PLAN, n_trials=2, settled=None), 0, tmp_path)
        with pytest.raises(InvalidInputError, match="expected the trials of"):
            run_test(replace(self.PLAN, n_trials=2), 0, tmp_path, True)

    def test_the_mean_number_of_actions_counts_every_trial(self):
        results = [TestResult(seed, (0, 2), (0, 0), (0, 2), actions=(seed, 4)) for seed in (0, 2)]
        number = actions_a_trial(results)
        assert number["mean"] == 2.5
        # s² = 11/3 over 4 trials; Student's 95 % point with 3 degrees of freedom is 3.182446.
        margin = 3.182446 * (11 / 12) ** 0.5
        assert number["interval95"] == pytest.approx([2.5 - margin, 2.5 + margin])
        assert actions_a_trial([TestResult(0, (0, 1), (0, 0), (0, 1), actions=(3,))])["interval95"] is None

    @pytest.mark.parametrize("settled", [0.0, float("nan")])
    def test_an_entropy_that_means_nothing_is_refused(self, settled):
        with pytest.raises(InvalidInputError, match=f": {settled}; expected a finite entropy"):
            TestPlan(settled=settled)
