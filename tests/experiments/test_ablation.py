import json
from dataclasses import replace

import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.experiments.ablation import NOISES, VARIANTS, AblationLog, Cell, run_ablation, summarise_ablation
from atg_fg.experiments.scores import TestResult
from atg_fg.experiments.table1 import run_test

CELLS = [Cell(variant, "ideal", noise, 3) for variant in ("paper", "default") for noise in ("ideal", "10% missing")]
N_TRIALS = 6


def test_a_cell_is_the_test_that_its_plan_says():
    results = run_ablation(CELLS[:1], [0, 1], N_TRIALS)
    plan = CELLS[0].plan(N_TRIALS)
    assert (plan.engine, plan.policy, plan.n_actions, plan.n_trials) == ("bayes-filter", "entropy", 3, N_TRIALS)
    assert [test.success for test in results[CELLS[0]]] == [run_test(plan, seed).success for seed in (0, 1)]


@pytest.mark.parametrize("variant", VARIANTS)
@pytest.mark.parametrize("noise", NOISES)
def test_every_variant_runs_under_every_noise(variant, noise):
    cell = Cell(variant, "ideal", noise, 2)
    assert cell.plan(N_TRIALS).world_options == NOISES[noise]
    if noise == "ideal":
        ((test,),) = run_ablation([cell], [0], 2).values()
        assert test.success[1] == 2


def test_it_goes_on_where_it_was_cut_off(tmp_path):
    whole = run_ablation(CELLS, [0, 1], N_TRIALS, AblationLog(tmp_path / "whole.jsonl", N_TRIALS))
    path = tmp_path / "part.jsonl"
    run_ablation(CELLS[:2], [0], N_TRIALS, AblationLog(path, N_TRIALS))
    path.write_bytes(path.read_bytes() + b'{"variant": "paper", "wor')
    ran = []
    resumed = run_ablation(CELLS, [0, 1], N_TRIALS, AblationLog(path, N_TRIALS), on_trials=ran.append)
    assert (ran[0], sum(ran)) == (2 * N_TRIALS, 8 * N_TRIALS)
    assert summarise_ablation(resumed) == summarise_ablation(whole)
    ran.clear()
    kept = run_ablation(CELLS, [0, 1], N_TRIALS, AblationLog(path, N_TRIALS), on_trials=ran.append)
    assert ran == [8 * N_TRIALS]
    assert summarise_ablation(kept) == summarise_ablation(whole)


@pytest.mark.parametrize("executor", ["thread", pytest.param("process", marks=pytest.mark.slow)])
def test_any_number_of_jobs_gives_the_same(executor):
    serial = run_ablation(CELLS, [0], N_TRIALS)
    others = run_ablation(CELLS, [0], N_TRIALS, jobs=2, executor=executor)
    assert summarise_ablation(others) == summarise_ablation(serial)


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"not JSON\n",
        b'{"format": "atg-fg/ablation", "version": 1, "trials": 7}\n',
        json.dumps({"format": "atg-fg/ablation", "version": 1, "trials": N_TRIALS}).encode() + b'\n{"variant": 3}\n',
    ],
    ids=["empty", "not JSON", "other trials", "not a test"],
)
def test_another_file_is_refused_and_left_as_it_is(tmp_path, content):
    path = tmp_path / "log.jsonl"
    path.write_bytes(content)
    with pytest.raises(
        InvalidInputError,
        match=r"log\.jsonl: .*(expected the log of an ablation|line 1: not valid JSON|line 2: key .world. is missing)",
    ):
        AblationLog(path, N_TRIALS)
    assert path.read_bytes() == content


def test_differences_are_paired_by_seed():
    """Success 0.5, 1.0 against 0.25, 0.25: differences 0.25 and 0.75, mean 0.5, standard error 0.25."""

    def tests(*successes):
        return [TestResult(seed, (0, 4), (0, 0), (count, 4)) for seed, count in enumerate(successes)]

    reference, other = CELLS[2], replace(CELLS[2], variant="learned")
    entries = summarise_ablation({reference: tests(1, 1), other: tests(2, 4)})
    assert entries[0]["above_reference"] is None
    assert entries[1]["above_reference"] == {"mean": 0.5, "standard_error": pytest.approx(0.25)}
    assert (entries[1]["success"], entries[1]["tests"]) == (0.75, 2)
