"""``check_engine`` takes what keeps the promises of ``Inference``, and finds each kind of fault."""

from copy import copy

import numpy as np
import pytest

from atg_fg.core.belief import IdentityBelief
from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.engines import ENGINES
from atg_fg.engines.bayes_filter import FilterInference
from atg_fg.engines.testing import TOLERANCE, check_engine


@pytest.mark.parametrize("engine", ENGINES)
def test_the_engines_there_are_keep_what_they_promise(engine):
    deviation = check_engine(engine, cases=8)
    assert deviation.looks == 24
    if ENGINES[engine].exact:
        assert max(deviation[:-1]) < TOLERANCE


class Plain(FilterInference):
    """What the model says, and nothing else."""

    name = "plain"
    exact = True

    def propagate(self, aspects, action):
        return self.model.predict(aspects, action)

    def correct(self, aspects, likelihood):
        return aspects * likelihood


class Sharper(Plain):
    def correct(self, aspects, likelihood):
        return aspects * likelihood**1.001


class Forgetful(Plain):
    def propagate(self, aspects, action):
        return aspects


class Unscaled(Plain):
    @property
    def scaled_log_evidence(self):
        return -1.0

    @scaled_log_evidence.setter
    def scaled_log_evidence(self, value):
        pass


class Careless(Plain):
    def compute_expected_entropies(self):
        return np.zeros(self.model.n_actions)


class Blurred(Plain):
    def compute_smoothed_aspects(self, hypothesis):
        return [np.full(len(each), 1 / len(each)) for each in super().compute_smoothed_aspects(hypothesis)]


class Restless(Plain):
    exact = False

    def identity(self):
        belief = super().identity()
        noise = np.random.default_rng().dirichlet(np.ones(len(belief.objects) + 1))
        return IdentityBelief.of(0.5 * np.append(belief.objects, belief.unseen) + 0.5 * noise, self.model.n_unseen)

    total_variation_bound = None


class Overconfident(Plain):
    exact = False
    total_variation_bound = 1e-6

    def identity(self):
        belief = super().identity()
        weights = np.append(belief.objects, belief.unseen) ** 2
        return IdentityBelief.of(weights / weights.sum(), self.model.n_unseen)


class Willing(Plain):
    def act(self, action):
        if not self.history.awaits_evidence and 0 <= action < self.model.n_actions:
            super().act(action)


class Shared(Plain):
    def __copy__(self):
        twin = object.__new__(type(self))
        twin.__dict__ = self.__dict__
        return twin


class Patient(Plain):
    def _condition(self, likelihood):
        if likelihood.any():
            super()._condition(likelihood)


class Nameless(Plain):
    name = None


@pytest.mark.parametrize(
    ("engine", "message"),
    [
        (Sharper, "is off by"),
        (Forgetful, "is off by"),
        (Unscaled, "log_evidence is off by"),
        (Careless, "expected_entropy is off by"),
        (Blurred, "smoothed is off by"),
        (Restless, "the same trial gave other numbers"),
        (Overconfident, "identity is off by .*; its bound is 1e-06"),
        (Willing, "an action before the first look was taken; expected InvalidInputError"),
        (Shared, "what was done to a copy has changed the engine"),
        (Patient, "a look that no object could give was taken; expected ImpossibleEvidenceError"),
        (Nameless, "name is None; expected a str"),
    ],
)
def test_a_fault_is_found_and_said(engine, message):
    with pytest.raises(AssertionError, match=message):
        check_engine(engine, cases=12)


def test_what_is_no_engine_is_refused():
    with pytest.raises(InvalidInputError, match=r"expected a subclass of atg_fg\.inference\.interface\.Inference"):
        check_engine("json:JSONDecoder")
    with pytest.raises(InvalidInputError, match=r"does not define .*predict"):
        check_engine("atg_fg.inference.interface:Inference")
    with pytest.raises(UnknownNameError, match="engine: unknown name 'magic'"):
        check_engine("magic")
    with pytest.raises(InvalidInputError, match="unknown option 'magic'"):
        check_engine("particle", magic=1)


def test_options_reach_the_engine():
    few, many = (check_engine("particle", cases=8, n_particles=number) for number in (10, 3000))
    assert many.identity < few.identity


def test_a_copy_is_what_it_was():
    engine = check_engine  # the check itself leaves no state behind
    assert engine(Plain, cases=4) == copy(engine)(Plain, cases=4)
