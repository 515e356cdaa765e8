"""The sampler against enumeration: a ring of three registers, of which one is seen, and three symbols."""

import itertools

import numpy as np
import pytest

from atg_fg.learning import chain as sampler
from atg_fg.learning import gibbs_kernels, kernels, object_kernels, slip_kernels, transition_kernels, weight_kernels
from atg_fg.learning.chain import Chain
from atg_fg.learning.detector_noise import DetectorNoise
from atg_fg.learning.kernels import TrialArrays
from atg_fg.learning.number_of_objects import log_new_weights, log_partition
from atg_fg.learning.raw_trials import Recording
from atg_fg.learning.sampling_task import Structure, Task

#: Action 0 turns the ring; action 1 leaves the third register where it is, and swaps the others.
RING = Structure(np.array([[1, 2, 0], [1, 0, 2]]), np.array([[0], [1], [2]]), 3)
CONTENTS = list(itertools.product(range(3), repeat=3))
PRIOR = np.full(3, 1 / 3)


def drawn_trials(rng, n_trials=4, n_looks=4):
    looks = rng.dirichlet(np.ones(3), size=(n_trials, n_looks, 1))
    actions = rng.integers(2, size=(n_trials, n_looks))
    return TrialArrays(looks, actions, np.full(n_trials, n_looks))


def test_numbers_are_shuffled_as_numpy_shuffles_them():
    rng, reference = np.random.default_rng(0), np.random.default_rng(0)
    for n in (1, 2, 3, 8, 9, 30):
        assert kernels.shuffled(n, rng).tolist() == reference.permutation(n).tolist()
        assert rng.random() == reference.random()


def likelihood(trials, trial, contents, start, slips=()):
    """p(looks | contents, start, slips), look by look."""
    state, result = start, 1.0
    for time in range(trials.lengths[trial]):
        result *= trials.looks[trial, time, 0, contents[state]]
        if time + 1 < trials.lengths[trial] and time not in slips:
            state = RING.successors[trials.actions[trial, time], state]
    return result


def joint_of(trials, cluster):
    """p(trials of one object, their starts given), summed over all contents."""
    return sum(
        np.prod([likelihood(trials, trial, contents, start, slips) for trial, start, slips in cluster]) / len(CONTENTS)
        for contents in CONTENTS
    )


def chain_of(trials, owner, start):
    """A chain that believes this of trials."""
    recording = Recording(
        np.zeros(trials.looks.shape[:3], dtype=np.int64),
        np.full(trials.looks.shape[:3], np.nan),
        trials.actions,
        trials.lengths,
        3,
    )
    n_trials = len(owner)
    task = Task(
        recording,
        trials.looks,
        log_new_weights(5, n_trials, n_trials + 3),
        log_partition(5, n_trials, n_trials + 3),
        np.zeros(0),
    )
    chain = Chain(RING, 0.0, 3)
    chain.admit(task)
    chain.clusters.owner[:] = owner
    chain.clusters.start[:] = start
    chain.clusters.n_trials[:] = np.bincount([each for each in owner if each >= 0], minlength=n_trials + 2)
    chain.log_joint(task)
    return chain, task


def test_evidence_of_a_fresh_object_is_the_sum_over_all_contents_and_starts():
    trials = drawn_trials(np.random.default_rng(1))
    stay = np.concatenate((RING.successors, [[0, 1, 2]]))
    found = kernels.fresh_log_evidence(trials, stay, RING.registers, 3, PRIOR)
    for trial in range(4):
        expected = sum(joint_of(trials, [(trial, start, ())]) for start in range(3)) / 3
        assert found[trial] == pytest.approx(np.log(expected), abs=1e-12)


def test_evidence_of_a_long_trial_does_not_underflow():
    trials = drawn_trials(np.random.default_rng(2), n_trials=1, n_looks=12)
    tiny = trials._replace(looks=trials.looks * 1e-40)
    one, other = (
        kernels.fresh_log_evidence(each, RING.successors, RING.registers, 3, PRIOR)[0] for each in (trials, tiny)
    )
    assert other == pytest.approx(one + 12 * np.log(1e-40), abs=1e-9)


def test_weights_of_a_trial_are_those_of_enumeration():
    trials = drawn_trials(np.random.default_rng(3))
    chain, _ = chain_of(trials, [0, 0, 1, -1], [0, 2, 1, 0])
    weights = np.zeros((len(chain.clusters.n_trials), 3))
    prior = object_kernels.cluster_weights(trials, 3, chain.clusters, 2, 0.7)
    weight_kernels.trial_weights(trials, 3, chain.clusters, 2, prior, weights)
    clusters = [[(0, 0, ()), (1, 2, ())], [(2, 1, ())]]
    for start in range(3):
        for number, cluster in enumerate(clusters):
            expected = joint_of(trials, [*cluster, (3, start, ())]) / joint_of(trials, cluster)
            assert weights[number, start] == pytest.approx(np.log(expected), abs=1e-12)
        assert weights[2, start] == pytest.approx(np.log(joint_of(trials, [(3, start, ())])) + 0.7, abs=1e-12)
    assert np.all(weights[3:] == -np.inf)


def test_a_trial_move_draws_from_the_conditional_distribution():
    trials = drawn_trials(np.random.default_rng(4), n_trials=3)
    chain, task = chain_of(trials, [0, 1, 1], [0, 2, 1])
    free = task.log_new[1]  # trial 0 was alone: one object is left without it
    other = [(1, 2, ()), (2, 1, ())]
    known = [joint_of(trials, [*other, (0, start, ())]) / joint_of(trials, other) for start in range(3)]
    novel = [joint_of(trials, [(0, start, ())]) * np.exp(free) for start in range(3)]
    expected = np.array([known, novel]) / (sum(known) + sum(novel))
    votes = np.zeros(len(chain.clusters.n_trials) + 1)
    rng, counts = np.random.default_rng(5), np.zeros((2, 3))
    for _ in range(4000):
        gibbs_kernels.sweep(trials, np.array([0]), chain.clusters, task.log_new, np.zeros(0), 1.0, rng, votes)
        counts[int(chain.clusters.owner[0] != 1), chain.clusters.start[0]] += 1
    assert votes[1] / 4000 == pytest.approx(expected[0].sum(), abs=1e-12)
    assert votes[-1] / 4000 == pytest.approx(expected[1].sum(), abs=1e-12)
    assert np.abs(counts / 4000 - expected).max() < 4 * np.sqrt(0.25 / 4000)


@pytest.mark.slow
def test_paths_with_slips_are_all_there_and_weigh_what_enumeration_says():
    trials = drawn_trials(np.random.default_rng(6), n_trials=2)
    chain, _ = chain_of(trials, [0, -1], [1, 0])
    odds = np.log(0.2 / 0.8)
    kernels.forget(chain.clusters, 1)
    prior = object_kernels.cluster_weights(trials, 1, chain.clusters, 1, -0.3)
    paths, scores = slip_kernels.slip_paths(trials, 1, trials.actions[1], chain.clusters, 1, prior, odds)
    subsets = [slips for n in range(4) for slips in itertools.combinations(range(3), n)]
    found = {
        (int(start), tuple(np.flatnonzero(slipped))): row
        for start, slipped, row in zip(paths.start, paths.slipped, scores, strict=True)
    }
    assert len(found) == 3 * len(subsets)
    cluster = [(0, 1, ())]
    for start, slips in itertools.product(range(3), subsets):
        prior = len(slips) * np.log(0.2) + (3 - len(slips)) * np.log(0.8)
        known = joint_of(trials, [*cluster, (1, start, slips)]) / joint_of(trials, cluster)
        novel = joint_of(trials, [(1, start, slips)])
        assert found[start, slips][0] == pytest.approx(prior + np.log(known), abs=1e-12)
        assert found[start, slips][1] == pytest.approx(prior - 0.3 + np.log(novel), abs=1e-12)


@pytest.mark.slow
def test_paths_of_a_long_trial_weigh_what_each_does_alone():
    """There are more histories on the way than there is room for: those that no path has any more are forgotten."""
    trials = drawn_trials(np.random.default_rng(10), n_trials=2, n_looks=90)
    chain, _ = chain_of(trials, [0, -1], [1, 0])
    kernels.forget(chain.clusters, 1)
    prior, stay = object_kernels.cluster_weights(trials, 1, chain.clusters, 1, -0.3), 2
    done, log_odds = trials.actions[1].copy(), np.log(0.3 / 0.7)
    paths, scores = slip_kernels.slip_paths(trials, 1, done, chain.clusters, 1, prior, log_odds)
    assert len(scores) > 100
    weights = np.zeros((len(chain.clusters.n_trials), 3))
    for slipped, start, score in zip(paths.slipped, paths.start, scores, strict=True):
        trials.actions[1] = np.where(slipped, stay, done)
        weight_kernels.trial_weights(trials, 1, chain.clusters, 1, prior, weights)
        log_prior = slipped.sum() * np.log(0.3) + (89 - slipped.sum()) * np.log(0.7)
        assert score == pytest.approx(weights[:, start] + log_prior, abs=1e-9)


def simulated(rng, n_trials, n_looks, contents, wrong=0.0):
    """Trials of objects with these contents, one after the other, from random starts."""
    labels = np.zeros((n_trials, n_looks, 1), dtype=np.int64)
    actions = rng.integers(2, size=(n_trials, n_looks))
    for trial in range(n_trials):
        state = rng.integers(3)
        for time in range(n_looks):
            label = contents[trial % len(contents)][state]
            labels[trial, time, 0] = (label + rng.integers(1, 3)) % 3 if rng.random() < wrong else label
            state = RING.successors[actions[trial, time], state]
    lengths = np.full(n_trials, n_looks)
    return Recording(labels, np.full(labels.shape, np.nan), actions, lengths, 3), np.arange(n_trials) % len(contents)


@pytest.mark.slow
def test_sampling_from_the_joint_and_from_its_conditionals_agree():
    """Geweke's test: data drawn anew between the moves leave the prior of partitions and of starts as it was."""
    rng, n_trials, n_looks = np.random.default_rng(9), 3, 3
    partitions = log_partition(5, n_trials, n_trials)
    # Three trials: 1 partition into one object, 3 into two, 1 into three.
    expected = np.exp(partitions[1:]) * np.array([1, 3, 1])
    expected /= expected.sum()
    noise = DetectorNoise.unknown(3)
    recording, _ = simulated(rng, n_trials, n_looks, [(0, 1, 2)])
    chain = Chain(RING, 0.0, 3)
    task = Task.of(recording, noise, 5)
    chain.admit(task)
    chain.scatter(rng)
    counts, starts, n_rounds = np.zeros(3), np.zeros(3), 6000
    for _ in range(n_rounds):
        chain.log_joint(task)
        chain.sweep(task, rng)
        counts[np.count_nonzero(chain.clusters.n_trials) - 1] += 1
        starts += np.bincount(chain.clusters.start, minlength=3)
        labels = np.zeros_like(recording.labels)
        tables = chain.clusters.tables
        contents = np.array([[rng.choice(3, p=row / row.sum()) for row in table] for table in tables])
        for trial in range(n_trials):
            state = chain.clusters.start[trial]
            for time in range(n_looks):
                symbol = contents[chain.clusters.owner[trial], state]
                labels[trial, time, 0] = symbol if rng.random() < 0.9 else (symbol + rng.integers(1, 3)) % 3
                state = RING.successors[recording.actions[trial, time], state]
        task = Task.of(recording._replace(labels=labels), noise, 5)
    # Successive rounds depend on each other: the bound allows for some twenty rounds of memory.
    assert np.abs(counts / n_rounds - expected).max() < 4 * np.sqrt(0.25 * 20 / n_rounds)
    assert np.abs(starts / starts.sum() - 1 / 3).max() < 4 * np.sqrt(0.25 * 20 / n_rounds)


@pytest.mark.slow
def test_probability_of_novelty_is_calibrated():
    """Of the last trials that are judged novel with probability p, the share p is of an object not met before."""
    rng, noise = np.random.default_rng(10), DetectorNoise.unknown(3)
    weights = np.exp(log_partition(3, 3, 3)[1:])
    of_partition = {
        (0, 0, 0): weights[0],
        (0, 0, 1): weights[1],
        (0, 1, 0): weights[1],
        (0, 1, 1): weights[1],
        (0, 1, 2): weights[2],
    }
    options = list(of_partition)
    shares = np.array(list(of_partition.values())) / sum(of_partition.values())
    said, was = [], []
    for _ in range(400):
        owners = options[rng.choice(len(options), p=shares)]
        contents = rng.integers(3, size=(3, 3))
        recording, _ = simulated(rng, 3, 5, [contents[owner] for owner in owners], wrong=0.1)
        task = Task.of(recording, noise, 3)
        chain = Chain(RING, 0.0, 3)
        chain.admit(task)
        chain.scatter(rng)
        chain.log_joint(task)
        votes = [chain.sweep(task, rng)[-1] for _ in range(12)]
        said.append(np.mean(votes[4:]))
        was.append(owners[2] not in owners[:2])
    said, was = np.array(said), np.array(was, dtype=float)
    spread = np.sqrt(np.sum(said * (1 - said)))
    assert abs(was.sum() - said.sum()) < 4 * spread
    high = said > np.median(said)
    assert was[high].mean() > was[~high].mean()


def test_the_same_seed_draws_the_same():
    trials = drawn_trials(np.random.default_rng(11))
    results = []
    for _ in range(2):
        chain, task = chain_of(trials, [0, 1, 2, 3], [0, 0, 0, 0])
        chain.sweep(task, np.random.default_rng(12))
        results.append((chain.clusters.owner.tolist(), chain.clusters.start.tolist()))
    assert results[0] == results[1]


def test_evidence_of_an_automaton_of_its_own_is_the_mean_over_all_automata():
    trials = drawn_trials(np.random.default_rng(13), n_trials=1, n_looks=3)
    total, n_automata = 0.0, 0
    for entries in itertools.product(range(2), repeat=4):
        successors = np.array(entries).reshape(2, 2)
        registers = np.array([[0], [1]])
        total += np.exp(kernels.fresh_log_evidence(trials, successors, registers, 2, PRIOR)[0])
        n_automata += 1
    found = gibbs_kernels.own_log_evidence(trials, 0, 2, 2, PRIOR, np.random.default_rng(0))
    assert found == pytest.approx(np.log(total / n_automata), abs=0.05)


def owned_trials(rng):
    """Two objects of one label a state, each moved by an automaton of its own, twelve trials in turn."""
    automata = [np.array([[1, 2, 0], [1, 0, 2]]), np.array([[2, 2, 1], [0, 1, 0]])]
    labels = np.zeros((12, 8, 1), dtype=np.int64)
    actions = rng.integers(2, size=(12, 8))
    for trial in range(12):
        state = rng.integers(3)
        for time in range(8):
            labels[trial, time, 0] = ((0, 1, 2), (3, 4, 5))[trial % 2][state]
            state = automata[trial % 2][actions[trial, time], state]
    return Recording(labels, np.full(labels.shape, np.nan), actions, np.full(12, 8), 6)


def test_objects_that_share_nothing_get_automata_of_their_own():
    rng = np.random.default_rng(14)
    recording = owned_trials(rng)
    task = Task.of(recording, DetectorNoise.unknown(6), 2)
    trials = TrialArrays(task.looks, recording.actions, recording.lengths)
    prior = np.full(6, 1 / 6)
    log_own = [gibbs_kernels.own_log_evidence(trials, trial, 3, 2, prior, rng) for trial in range(12)]
    task = task._replace(log_own=np.array(log_own))
    chain = Chain(Structure(rng.integers(3, size=(2, 3)), np.array([[0], [1], [2]]), 3), 0.0, 6, may_own=True)
    chain.admit(task)
    chain.scatter(rng)
    chain.log_joint(task)
    for beta in (*np.geomspace(0.1, 1.0, 30), *np.ones(10)):
        chain.sweep(task, rng, beta, automaton=True)
    owner = chain.clusters.owner
    assert len({*owner[::2]}) == len({*owner[1::2]}) == 1
    assert owner[0] != owner[1]
    # One may keep the shared automaton for itself; the other has its own.
    assert len(chain.own_automata) >= 1


def test_errors_that_recur_are_the_structures_and_those_that_do_not_are_the_detectors():
    rng = np.random.default_rng(15)
    odds = []
    for contents in ([0, 1, 2], [0, 1, 2]), ([0, 1, 2], [3, 4, 5]):
        # In the second case the third side shows something else each time that the first action has been tried.
        labels = np.zeros((10, 12, 1), dtype=np.int64)
        actions = rng.integers(2, size=(10, 12))
        for trial in range(10):
            state, mode = rng.integers(3), 0
            for time in range(12):
                is_wrong = rng.random() < 0.2 and contents[0] == contents[1]
                labels[trial, time, 0] = rng.integers(6) if is_wrong else contents[mode][state]
                state, mode = RING.successors[actions[trial, time], state], int(rng.random() < 0.3)
        recording = Recording(labels, np.full(labels.shape, np.nan), actions, np.full(10, 12), 6)
        task = Task.of(recording, DetectorNoise.unknown(6), 1)
        chain = Chain(RING, 0.0, 6)
        chain.admit(task)
        chain.scatter(rng)
        for _ in range(10):
            chain.sweep(task, rng)
        odds.append(chain.log_odds_of_mistakes(task))
    assert odds[0] < 0 < odds[1]
    chain.wrong[:] = True  # looks that are wrong in all slots are the detector's, whatever they show
    assert chain.log_odds_of_mistakes(task) == 0.0


@pytest.mark.parametrize("n_looks", [4, 40])
def test_an_entry_is_drawn_by_what_the_trials_that_pass_it_say(n_looks):
    trials = drawn_trials(np.random.default_rng(19), n_looks=n_looks)
    chain, _ = chain_of(trials, [0, 0, 1, 0], [0, 1, 2, 0])
    clusters, successors = chain.clusters, chain.clusters.successors[0]
    work, scores = transition_kernels.room_for(clusters), np.empty(3)
    paths = np.empty(trials.actions.shape, dtype=np.int64)
    for action, state in itertools.product(range(2), range(3)):
        before, joint = successors[action, state], []
        for successor in range(3):
            successors[action, state] = successor
            joint.append(kernels.learn_all_again(trials, clusters, 0, paths[0]))
        successors[action, state] = before
        transition_kernels.walk_all(trials, clusters, 0, paths)
        transition_kernels.score_successors(trials, clusters, 0, action, state, paths, work, scores)
        assert np.allclose(np.diff(scores), np.diff(joint), atol=1e-12 * n_looks)
        assert successors[action, state] == before


def test_beyond_two_hundred_trials_a_sweep_moves_a_bounded_number(monkeypatch):
    monkeypatch.setattr(sampler, "ALL_TRIALS", 12)
    monkeypatch.setattr(sampler, "OTHER_TRIALS", 4)
    rng = np.random.default_rng(16)
    recording, _ = simulated(rng, 24, 6, [(0, 1, 2), (0, 0, 1), (2, 2, 1)])
    task = Task.of(recording, DetectorNoise.unknown(3), 3)
    chain = Chain(RING, 0.0, 3)
    chain.admit(task)
    chain.place(task, np.arange(24), rng)
    moved = [chain._order(rng) for _ in range(30)]
    assert {len(order) for order in moved} == {13 if len(chain._touched) >= 8 else len(chain._touched) + 5}
    assert all(order[-1] == 23 and len({*order}) == len(order) for order in moved)
    # Chance brings every trial its turn, and each sweep leaves a proper distribution over objects.
    assert len({*np.concatenate(moved)}) > 20
    assert np.allclose([chain.sweep(task, rng).sum() for _ in range(5)], 1.0)


def test_annealing_many_trials_places_all_of_them(monkeypatch):
    monkeypatch.setattr(sampler, "ALL_TRIALS", 10)
    rng = np.random.default_rng(17)
    recording, _ = simulated(rng, 20, 9, [(0, 1, 2), (0, 0, 1)])
    task = Task.of(recording, DetectorNoise.unknown(3), 2)
    chain = Chain(RING, 0.0, 3)
    chain.admit(task)
    chain.anneal(task, 0.1, 20, rng)
    assert chain.clusters.owner.min() >= 0
    assert chain.clusters.n_trials.sum() == 20
