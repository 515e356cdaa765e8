from dataclasses import replace

import numpy as np
import pytest

from atg_fg.core.errors import UnknownNameError
from sim.worlds.domain_randomization import CONDITIONS, Circumstances, condition_named

RANGES = ("cube_mass", "pad_friction", "pad_patch")


def draws(name, n, seed=0):
    rng = np.random.default_rng(seed)
    return [condition_named(name).draw(rng) for _ in range(n)]


def test_the_conditions_have_names():
    assert list(CONDITIONS) == ["nominal", "worn"]
    for name, condition in CONDITIONS.items():
        assert condition_named(name) is condition


def test_every_condition_is_told_in_one_line():
    assert all(condition.summary and "\n" not in condition.summary for condition in CONDITIONS.values())


@pytest.mark.parametrize("name", CONDITIONS)
def test_what_is_drawn_stays_in_its_range(name):
    condition = CONDITIONS[name]
    for drawn in draws(name, 1000):
        for quantity in RANGES:
            least, most = getattr(condition, quantity)
            assert least <= getattr(drawn, quantity) <= most
        assert np.abs(drawn.lean).max() <= condition.largest_lean
        assert drawn.imaging == condition.imaging


def test_what_is_drawn_fills_its_range():
    condition = CONDITIONS["worn"]
    drawn = draws("worn", 1000)
    for quantity in RANGES:
        least, most = getattr(condition, quantity)
        shares = (np.array([getattr(one, quantity) for one in drawn]) - least) / (most - least)
        assert shares.min() < 0.02
        assert shares.max() > 0.98
        assert shares.mean() == pytest.approx(0.5, abs=0.05)
    leans = np.array([one.lean for one in drawn]) / condition.largest_lean
    np.testing.assert_allclose(leans.min(axis=0), -1, atol=0.02)
    np.testing.assert_allclose(leans.max(axis=0), 1, atol=0.02)


def test_each_quantity_is_drawn_alone():
    drawn = draws("worn", 2000)
    values = [[*(getattr(one, quantity) for quantity in RANGES), *one.lean] for one in drawn]
    correlations = np.corrcoef(np.array(values).T) - np.eye(5)
    assert np.abs(correlations).max() < 4 / np.sqrt(2000)


def test_nominal_physics_are_always_the_same():
    drawn = draws("nominal", 100)
    assert {(one.cube_mass, one.pad_friction, one.pad_patch, one.lean) for one in drawn} == {(0.8, 1.2, 0.03, (0, 0))}
    assert all(one == Circumstances() for one in drawn)


def test_what_no_condition_changes_is_always_the_same():
    fixed = {(one.cube_friction, one.table_friction) for name in CONDITIONS for one in draws(name, 20)}
    assert fixed == {(0.8, 0.4)}


def test_worn_pads_are_never_as_good_as_nominal_ones():
    nominal, worn = CONDITIONS["nominal"], CONDITIONS["worn"]
    assert worn.pad_friction[1] < nominal.pad_friction[0]
    assert worn.pad_patch[1] <= nominal.pad_patch[0]
    assert worn.imaging.image_noise > nominal.imaging.image_noise
    assert worn.imaging.light_jitter > nominal.imaging.light_jitter


@pytest.mark.parametrize("name", CONDITIONS)
def test_the_same_generator_draws_the_same(name):
    assert draws(name, 20, seed=7) == draws(name, 20, seed=7)


def test_other_generators_draw_other_circumstances():
    assert draws("worn", 1, seed=7) != draws("worn", 1, seed=8)


@pytest.mark.parametrize("name", CONDITIONS)
def test_every_condition_draws_the_same_number_of_times(name):
    # So that what is drawn afterwards does not depend on the condition.
    after, expected = np.random.default_rng(0), np.random.default_rng(0)
    CONDITIONS[name].draw(after)
    expected.uniform(size=5)
    assert after.bit_generator.state == expected.bit_generator.state


def test_a_range_of_one_value_draws_that_value():
    condition = replace(CONDITIONS["worn"], cube_mass=(1.5, 1.5), largest_lean=0.0)
    drawn = condition.draw(np.random.default_rng(0))
    assert drawn.cube_mass == 1.5
    assert drawn.lean == (0, 0)


def test_an_unknown_condition_is_refused_and_the_known_ones_are_named():
    with pytest.raises(UnknownNameError, match="condition: unknown name 'icy'; expected one of: nominal, worn"):
        condition_named("icy")
