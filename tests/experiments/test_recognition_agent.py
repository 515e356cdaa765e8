"""Our recogniser in loops of others."""

import subprocess
import sys

import gymnasium
import numpy as np
import pytest

from atg_fg.core.assumptions import Assumptions, arcube_assumptions
from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.core.patterns import MISSING, PatternAlphabet
from atg_fg.experiments.exploration import complete_memory
from atg_fg.experiments.recognition_agent import RecognitionAgent
from atg_fg.learning.structured_memory import memory_for
from atg_fg.policies import StoppingPolicy, make_policy
from atg_fg.storage.memory_files import load_memory, open_memory
from atg_fg.storage.presets import preset
from atg_fg.worlds.arcube import make_arcubes
from atg_fg.worlds.arcube_world import ARcubeWorld
from atg_fg.worlds.registry import make_world
from tests.small import trial

CUBES = make_arcubes(6, seed=0)
PARAMETERS = preset("default")


@pytest.fixture
def memory():
    """All that there is to know of the first five of six cubes."""
    return complete_memory(arcube_assumptions(6), CUBES[:5])


def test_it_recognises_an_object_in_a_plain_loop(memory):
    agent, world = RecognitionAgent(memory, PARAMETERS), ARcubeWorld(CUBES)
    for presented in range(6):
        observation, _ = world.reset(seed=presented, options={"object": presented})
        agent.reset()
        for _ in range(8):
            observation, *_ = world.step(np.int64(agent(observation)))
        agent.observe(observation)
        known = None if agent.belief.is_novel else agent.belief.most_probable_object
        assert known == (None if presented == 5 else presented)


def test_its_belief_is_that_of_a_trial_with_the_same_looks_and_actions(memory):
    agent = RecognitionAgent(memory, PARAMETERS)
    actions = [int(agent.predict(np.array(look))[0]) for look in ((0, 1), (2, 3))]
    agent.observe([4, MISSING])
    assert agent.inference.history.actions == actions
    looks = agent.inference.history.evidence
    assert [look.pattern is None for look in looks] == [False, False, True]
    again = trial("gtsam", memory, PARAMETERS)
    for look, action in zip(looks, [*actions, None], strict=True):
        again.observe(look)
        if action is not None:
            again.act(action)
    np.testing.assert_allclose(again.identity().probabilities, agent.belief.probabilities, atol=1e-12)


def test_an_action_is_what_a_world_takes(memory):
    action, state = RecognitionAgent(memory, PARAMETERS).predict(np.array([0, 1]))
    assert state is None
    assert ARcubeWorld(CUBES).action_space.contains(action.item())
    assert (action.shape, action.dtype) == ((), np.int64)


def test_many_worlds_have_a_belief_each(memory):
    agent = RecognitionAgent(memory, PARAMETERS)
    worlds = [ARcubeWorld(CUBES) for _ in range(3)]
    looks = np.array([world.reset(seed=i, options={"object": i})[0] for i, world in enumerate(worlds)])
    starts = np.ones(3, dtype=bool)
    for _ in range(8):
        actions, _ = agent.predict(looks, state=None, episode_start=starts, deterministic=True)
        looks = np.array([world.step(action)[0] for world, action in zip(worlds, actions, strict=True)])
        starts = np.zeros(3, dtype=bool)
    agent.observe(looks)
    assert [each.identity().most_probable_object for each in agent.trials] == [0, 1, 2]


def test_a_trial_begins_where_an_episode_does_and_goes_on_elsewhere(memory):
    agent = RecognitionAgent(memory, PARAMETERS)
    looks = np.array([[0, 1], [0, 1]])
    agent.predict(looks)
    agent.predict(looks, episode_start=np.array([False, True]))
    assert [len(each.history.evidence) for each in agent.trials] == [2, 1]


def test_the_same_seed_chooses_alike_and_ties_are_broken_by_it(memory):
    def choices(seed):
        agent = RecognitionAgent(memory, PARAMETERS, policy="random", seed=seed)
        return [agent([0, 1]) for _ in range(20)]

    assert choices(1) == choices(1)
    assert choices(1) != choices(2)


def test_the_memory_is_not_changed(memory):
    before = memory.copy()
    agent = RecognitionAgent(memory, PARAMETERS)
    agent([0, 1])
    agent.observe([2, 3])
    assert memory == before


@pytest.mark.parametrize(
    ("observation", "message"),
    [
        ([0], r"shape \(1,\); expected \(2,\) for one world, or \(worlds, 2\)"),
        (np.zeros((1, 1, 2), int), "shape"),
        (np.zeros((0, 2), int), "shape"),
        ([0, 12], "symbol 12; expected 0 to 11"),
        ([3, 3], "symbol 3 is repeated"),
    ],
)
def test_other_observations_are_refused_and_change_nothing(memory, observation, message):
    agent = RecognitionAgent(memory, PARAMETERS)
    with pytest.raises(InvalidInputError, match=message):
        agent.predict(observation)
    assert agent.trials == []


def test_what_makes_no_sense_is_refused(memory):
    agent = RecognitionAgent(memory, PARAMETERS)
    with pytest.raises(InvalidInputError, match="nothing seen yet"):
        _ = agent.belief
    agent.predict([[0, 1], [0, 1]])
    with pytest.raises(InvalidInputError, match="observations of 1 worlds; expected 2 as before"):
        agent([0, 1])
    with pytest.raises(UnknownNameError, match="engine"):
        RecognitionAgent(memory, PARAMETERS, engine="magic")
    with pytest.raises(UnknownNameError, match="policy"):
        RecognitionAgent(memory, PARAMETERS, policy="magic")
    ends = RecognitionAgent(memory, PARAMETERS, policy=StoppingPolicy(make_policy("entropy"), 100.0))
    with pytest.raises(InvalidInputError, match="the policy ends the trial"):
        ends([0, 1])


# torch and pandas have warnings of their own when they are loaded.
@pytest.mark.peers
@pytest.mark.parametrize("name", ["ideal", "prism", "detector", "repeated-tags"])
def test_stable_baselines3_trains_on_a_world_as_it_is(name):
    sb3 = pytest.importorskip(
        "stable_baselines3", reason="Stable-Baselines3 is not installed: pip install atg-fg[agents]"
    )
    model = sb3.PPO("MlpPolicy", make_world(name, missing=0.3), n_steps=32, batch_size=32, seed=0, device="cpu")
    assert model.learn(64).num_timesteps == 64


@pytest.mark.peers
@pytest.mark.filterwarnings("ignore")
def test_stable_baselines3_evaluates_it(memory):
    evaluation = pytest.importorskip(
        "stable_baselines3.common.evaluation", reason="Stable-Baselines3 is not installed: pip install atg-fg[agents]"
    )
    agent = RecognitionAgent(memory, ModelParameters())
    world = gymnasium.wrappers.TimeLimit(ARcubeWorld(CUBES), max_episode_steps=4)
    rewards, lengths = evaluation.evaluate_policy(agent, world, n_eval_episodes=3, return_episode_rewards=True)
    assert (rewards, lengths) == ([0.0] * 3, [4] * 3)


class TestALoopOfOnesOwn:
    """A robot that looks as often as it likes, and does what it can."""

    @pytest.fixture
    def named(self):
        alphabet = PatternAlphabet.named(("front", "top"), [f"tag-{number}" for number in range(12)])
        assumptions = Assumptions(10, 24, ("flip", "left", "right"), alphabet)
        return RobotMemory(assumptions)

    def test_it_looks_acts_and_learns_until_it_is_settled(self, named):
        agent = RecognitionAgent(
            named, ModelParameters(learn_in_trial=True), policy=StoppingPolicy(make_policy("entropy"), 1e-4)
        )
        names, world = [], ARcubeWorld(CUBES[:2])
        for number, cube in enumerate([0, 1, 0, 1, 0, 1]):
            observation, _ = world.reset(seed=number, options={"object": cube})
            for _ in range(20):
                agent.observe([f"tag-{symbol}" for symbol in observation])
                agent.observe({"front": f"tag-{observation[0]}"})  # a second frame, of the front alone
                proposal = agent.next_action()
                if proposal.settled and number > 1:
                    break
                done = proposal.action or "flip"
                observation, *_ = world.step(np.int64(named.assumptions.action_index(done)))
                agent.did(done)
            assert (proposal.purpose == "settled") == proposal.settled
            verdict = agent.verdict
            names.append((verdict.verdict, agent.learn()))
        assert [verdict for verdict, _ in names] == ["novel", "novel", "known", "known", "known", "known"]
        assert names[0][1] == names[2][1] == names[4][1] != names[1][1]

    def test_what_was_done_may_be_something_else_than_was_proposed(self, named):
        agent = RecognitionAgent(named, ModelParameters())
        agent.observe(("tag-1", "tag-2"))
        assert agent.next_action().action in ("flip", "left", "right")
        assert agent.next_action().expected_entropy is not None
        agent.did({"left": 0.9, None: 0.1})
        agent.observe(None)
        assert agent.verdict.verdict == "novel"
        assert agent.learn("cup") == "cup"
        assert named.names == ("cup",)
        assert named["cup"].counts == {}  # it is not sure what was done
        with pytest.raises(InvalidInputError, match="nothing seen yet"):
            agent.verdict  # noqa: B018

    def test_nothing_seen_is_no_verdict_and_nothing_to_learn(self, named):
        agent = RecognitionAgent(named, ModelParameters())
        agent.observe(None)
        assert agent.verdict.verdict == "undecided"
        assert agent.learn() is None
        assert len(named) == 0

    def test_likelihoods_alone_are_learned_where_they_make_a_pattern_more_probable_than_not(self, named):
        agent = RecognitionAgent(named, ModelParameters())
        agent.observe({"front": {"tag-1": 0.8}, "top": "tag-2"})
        agent.did("left")
        agent.observe({"front": {"tag-3": 0.3}, "top": "tag-2"})
        assert agent.learn() == "object-000"
        assert named["object-000"].aspects == ((1, 2),)

    def test_labels_that_nobody_knew_are_learned_with_the_trial(self):
        alphabet = PatternAlphabet.named(("front", "top"), ("logo", "lid"), exclusive=False, is_open=True)
        memory = RobotMemory(Assumptions(5, 4, ("turn",), alphabet))
        agent = RecognitionAgent(memory, ModelParameters())
        for number in range(2):
            agent.observe(("logo", "lid"))
            agent.did("turn")
            agent.observe({"front": "barcode", "top": "lid"})
            agent.observe(np.array([2, MISSING]))
            assert agent.next_action().action == "turn"
            assert agent.verdict.verdict == ("known" if number else "novel")
            assert memory.assumptions.alphabet.names == (("logo", "lid", "barcode") if number else ("logo", "lid"))
            agent.learn("cup")
        assert memory["cup"].aspects == ((0, 1), (2, 1))
        assert memory["cup"].counts == {(0, 0, 1): 2}

    def test_two_robots_may_meet_labels_in_another_order(self, tmp_path):
        alphabet = PatternAlphabet.named(("front", "top"), ("logo", "lid"), exclusive=False, is_open=True)
        assumptions, parameters = Assumptions(5, 4, ("turn",), alphabet), preset("learned")
        path = tmp_path / "robot.db"
        with (
            memory_for(parameters, open_memory(path, assumptions)) as one,
            memory_for(parameters, open_memory(path, assumptions)) as other,
        ):
            agents = [RecognitionAgent(memory, parameters, engine="learned-structure") for memory in (one, other)]
            for agent, new in zip(agents, ("seal", "base"), strict=True):
                agent.observe({"front": {"lid": 0.5, "logo": 0.2}, "top": "lid"})
                agent.did("turn")
                agent.observe((new, "lid"))
                agent.did("turn")
                agent.observe(("logo", new))
            assert [agent.learn(name) for agent, name in zip(agents, ("cup", "box"), strict=True)] == ["cup", "box"]
            one.refresh()
            assert one == other == load_memory(path)
        names = ("logo", "lid", "seal", "base")
        assert one.assumptions.alphabet.names == names
        assert [[tuple(names[symbol] for symbol in aspect) for aspect in graph.aspects] for graph in one] == [
            [(new, "lid"), ("logo", new)] for new in ("seal", "base")
        ]
        # What a look left to all other labels went to the new one; what came later is as improbable as the least.
        likelihoods = [trial.likelihoods[0][0] for trial in one.learner.trials]
        np.testing.assert_allclose(likelihoods, [(0.2, 0.5, 0.3, 0.2), (0.2, 0.5, 0.2, 0.3)])

    def test_two_processes_share_a_memory(self, named, tmp_path):
        path = tmp_path / "robot.db"
        open_memory(path, named.assumptions).close()
        code = (
            "import sys\nfrom atg_fg import RecognitionAgent, preset\n"
            "from atg_fg.storage.memory_files import open_memory\n"
            "with open_memory(sys.argv[1]) as memory:\n"
            "    agent = RecognitionAgent(memory, preset('default'))\n"
            "    for number in range(4):\n"
            "        agent.observe((int(sys.argv[2]) + number, 11))\n"
            "        print(agent.learn(f'{sys.argv[2]}-{number}'))\n"
        )
        running = [
            subprocess.Popen([sys.executable, "-c", code, str(path), first], stdout=subprocess.PIPE, text=True)
            for first in ("0", "4")
        ]
        assert [each.communicate(timeout=120)[0].split() for each in running] == [
            [f"{first}-{number}" for number in range(4)] for first in ("0", "4")
        ]
        with open_memory(path, read_only=True) as memory:
            assert sorted(memory.names) == sorted(f"{first}-{number}" for first in "04" for number in range(4))
