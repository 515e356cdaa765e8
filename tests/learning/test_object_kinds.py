"""What a person is told of the kinds of objects in a memory."""

import numpy as np
import pytest

from atg_fg.core.memory import RobotMemory
from atg_fg.engines import begin_trial
from atg_fg.learning.learner import StructureLearner
from atg_fg.learning.object_kinds import kinds_of
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.storage.presets import preset
from tests.learning.worlds import ARCUBES, CUBE, cubes, trial_of, uncertain_object, uncertain_trial


@pytest.fixture(scope="module")
def memory():
    """Six cubes, and twelve objects whose actions are uncertain."""
    memory, rng = StructuredMemory(ARCUBES), np.random.default_rng(0)
    others = [uncertain_object(rng) for _ in range(3)]
    trials = [trial_of(each, 10, rng) for each in cubes(6)]
    trials += [uncertain_trial(others[number % 3], 10, rng) for number in range(12)]
    for trial in trials:
        name = memory.learn([ARCUBES.alphabet.index(look) for look in trial.detections], list(trial.actions), None)
        memory.learn_shared(name, trial.detections, trial.actions)
    return memory


def test_each_kind_has_its_members_and_says_what_it_is_like(memory):
    cube, unsure, plain = kinds_of(memory)
    assert cube.structure == CUBE
    assert str(cube) == "a thing like these 6: 6 places, 24 poses"
    assert cube.members == memory.names[:6]
    assert "uncertain actions, α = " in str(unsure)
    assert set(unsure.members) <= set(memory.names[6:])
    assert len(unsure.members) > 8
    assert plain.words == "a graph of its own"
    assert sum(kind.share for kind in (cube, unsure, plain)) == pytest.approx(1.0)
    np.testing.assert_allclose(sum(kind.probabilities for kind in (cube, unsure, plain)), 1.0)


def test_a_kind_is_as_probable_as_the_sets_that_it_is_in(memory, monkeypatch):
    (cube,) = memory.learner.believed(memory.names)
    monkeypatch.setattr(StructureLearner, "believed", lambda self, names: [cube._replace(weight=0.4)])
    told = kinds_of(memory)[0]
    np.testing.assert_allclose(told.probabilities, 0.4 * cube.followers)
    assert (told.share, told.members) == (pytest.approx(0.4 * cube.share), ())


def test_where_nothing_was_learned_all_are_plain():
    (kind,) = kinds_of(RobotMemory(ARCUBES))
    assert (kind.share, kind.members, str(kind)) == (1.0, (), "a thing like none yet: a graph of its own")


def test_in_a_trial_the_kind_shows_itself(memory):
    trial = trial_of(cubes(9)[8], 8, np.random.default_rng(1))
    inference = begin_trial("learned-structure", memory, preset("learned"))
    beliefs = []
    for time, look in enumerate(trial.detections):
        if time:
            inference.act(trial.actions[time - 1])
        inference.observe(look)
        beliefs.append(inference.kind_belief())
        assert sum(beliefs[-1].values()) == pytest.approx(1.0)
    assert beliefs[0]["6 places, 24 poses"] < 0.8
    assert beliefs[-1]["6 places, 24 poses"] > 0.99
