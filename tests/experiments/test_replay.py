import copy
import json
import math

import pytest

from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.engines import ENGINES
from atg_fg.experiments.replay import replay
from atg_fg.storage.scripted_trial import read_script
from tests.small import EXACT_ENGINES, every_exact_engine

SCRIPT = {
    "format": "atg-fg/scripted-trial",
    "version": 1,
    "assumptions": {
        "n_objects": 100,
        "n_aspects": 24,
        "actions": ["flip", "left", "right"],
        "slots": ["front", "top"],
        "n_symbols": 12,
    },
    "parameters": {"transition_concentration": 1e-6, "observation_noise": 1e-6, "learn_in_trial": False},
    "memory": [
        {
            "name": "cube-000",
            "aspects": [[0, 1], [1, 5]],
            "transitions": [{"from": 0, "action": "flip", "to": 1, "count": 1}],
        }
    ],
    "steps": [{"observe": [0, 1]}, {"act": "flip"}, {"observe": [1, None]}],
}


def script(change=lambda document: None):
    document = copy.deepcopy(SCRIPT)
    change(document)
    return read_script(json.dumps(document), "trial.json")


def numbers(value):
    if isinstance(value, dict):
        return [number for item in value.values() for number in numbers(item)]
    if isinstance(value, list):
        return [number for item in value for number in numbers(item)]
    return [value] if isinstance(value, float) else []


@pytest.mark.parametrize("learn", [False, True])
def test_the_same_script_gives_the_same_posteriors_in_every_exact_engine(learn):
    trial = script(lambda d: d["parameters"].update(learn_in_trial=learn))
    documents = [replay(trial, engine, smooth=True) for engine in EXACT_ENGINES]
    for document in documents[1:]:
        assert numbers(document) == pytest.approx(numbers(documents[0]), abs=1e-12)
        assert document["smoothed"]["object"] == documents[0]["smoothed"]["object"]


@every_exact_engine
def test_steps_have_the_promised_keys(engine):
    document = json.loads(json.dumps(replay(script(), engine), allow_nan=False))
    assert document["engine"] == engine
    look, act, last = document["steps"]
    both = {"step", "kind", "objects", "unseen", "entropy", "log_evidence"}
    assert set(look) == set(last) == both | {"expected_entropy", "best_actions"}
    assert set(act) == both
    assert [step["kind"] for step in document["steps"]] == ["observe", "act", "observe"]
    assert list(look["expected_entropy"]) == ["flip", "left", "right"]
    assert look["best_actions"] == ["flip"]
    assert act["log_evidence"] == look["log_evidence"]


@every_exact_engine
def test_the_first_look_is_right_by_hand(engine):
    # p(z | cube-000) = (1 - d)/24 + d/132 for a known pattern; p(z | unseen) = (1 - d)/132 + d/132 = 1/132.
    delta = 1e-6
    known, unseen = (1 - delta) / 24 + delta / 132, 1 / 132
    evidence = 0.01 * known + 0.99 * unseen
    step = replay(script(), engine)["steps"][0]
    assert step["objects"]["cube-000"] == pytest.approx(0.01 * known / evidence, abs=1e-12)
    assert step["unseen"] == pytest.approx(0.99 * unseen / evidence, abs=1e-12)
    assert step["log_evidence"] == pytest.approx(math.log(evidence), abs=1e-12)


@every_exact_engine
def test_seeing_nothing_changes_no_belief(engine):
    trial = script(lambda d: d.update(steps=[{"observe": [0, 1]}, {"act": "flip"}, {"observe": [None, None]}]))
    _, act, look = replay(trial, engine)["steps"]
    assert look["unseen"] == pytest.approx(act["unseen"], abs=1e-12)
    assert look["log_evidence"] == pytest.approx(act["log_evidence"], abs=1e-12)


def test_a_script_may_end_with_an_action():
    trial = script(lambda d: d["steps"].pop())
    for engine in ENGINES:
        document = replay(trial, engine, smooth=True)
        assert document["steps"][-1]["kind"] == "act"
        assert [step["step"] for step in document["smoothed"]["steps"]] == [0]


def test_an_engine_with_a_bound_says_it_at_every_step():
    for step in replay(script(), "large-memory")["steps"]:
        assert step["total_variation_bound"] == 0
    assert "total_variation_bound" not in replay(script(), "mean-field")["steps"][0]


def test_smoothed_aspects_are_probabilities_of_the_likeliest_object():
    smoothed = replay(script(), "gtsam", smooth=True)["smoothed"]
    assert smoothed["object"] == "cube-000"
    assert [step["step"] for step in smoothed["steps"]] == [0, 2]
    for step in smoothed["steps"]:
        assert math.isclose(sum(a["probability"] for a in step["aspects"]) + step["collection"], 1)
    assert smoothed["steps"][1]["aspects"][1]["pattern"] == [1, 5]
    assert smoothed["steps"][1]["aspects"][1]["probability"] > 0.999


@pytest.mark.parametrize("engine", ENGINES)
def test_evidence_of_probability_zero_is_refused_by_step(engine):
    # Without noise, and learning within the trial, what was counted once is certain: flip leads from 01 to 23.
    def contradicts_itself(document):
        document["parameters"] = {"observation_noise": 0, "transition_concentration": 0, "learn_in_trial": True}
        looks = [{"observe": pattern} for pattern in ([0, 1], [2, 3], [0, 1], [4, 5])]
        document["steps"] = [step for look in looks for step in (look, {"act": "flip"})]

    with pytest.raises(InvalidInputError, match=r"trial.json: steps\[6\]: the evidence has probability zero"):
        replay(script(contradicts_itself), engine)


@pytest.mark.parametrize(
    ("change", "place"),
    [
        (lambda d: d.update(steps=[]), "steps: empty"),
        (lambda d: d["steps"].insert(0, {"act": "flip"}), r"steps\[0\]: 'act'; expected 'observe'"),
        (lambda d: d["steps"].insert(1, {"observe": [0, 1]}), r"steps\[1\]: 'observe'; expected 'act'"),
        (lambda d: d["steps"].insert(1, {"act": "flip", "observe": [0, 1]}), r"steps\[1\]: unknown key 'observe'"),
        (lambda d: d["steps"].insert(1, "flip"), r"steps\[1\]: 'flip'; expected an object with act"),
        (lambda d: d["steps"][1].update(act="roll"), r"steps\[1\].act: 'roll'; expected one of"),
        (lambda d: d["steps"][1].update(act=None), r"steps\[1\].act: None; expected one of"),
        (lambda d: d["steps"][0].update(observe=[0, 12]), r"steps\[0\].observe, slot 'top': symbol 12"),
        (lambda d: d["steps"][0].update(observe=[0, 0]), r"steps\[0\].observe, slot 'top': symbol 0 is repeated"),
        (lambda d: d["steps"][0].update(observe=[0]), r"steps\[0\].observe: .*expected one entry for each"),
        (lambda d: d["steps"][0].update(observe="01"), r"steps\[0\].observe: '01'; expected a list"),
        (lambda d: d["parameters"].update(observation_noise=1), "parameters.observation_noise: 1"),
        (lambda d: d["parameters"].update(observation_noise=-0.1), "parameters.observation_noise: -0.1"),
        (lambda d: d["parameters"].update(transition_concentration=-1), "parameters.transition_concentration: -1"),
        (lambda d: d["parameters"].update(transition_concentration=10**400), "parameters.transition_concentration"),
        (lambda d: d["parameters"].update(transition_concentration="1"), "parameters.transition_concentration: '1'"),
        (lambda d: d["parameters"].update(learn_in_trial=1), "parameters.learn_in_trial: 1; expected true or false"),
        (lambda d: d["parameters"].update(extra=1), "parameters: unknown key 'extra'"),
        (lambda d: d["parameters"].pop("learn_in_trial"), "parameters: key 'learn_in_trial' is missing"),
        (lambda d: d["memory"].append(d["memory"][0]), r"memory\[1\]: .*'cube-000' is repeated"),
        (lambda d: d["assumptions"].update(n_aspects=1), r"memory\[0\].aspects\[1\]: .*at most n_aspects = 1"),
        (lambda d: d.update(version=3), "version: 3; expected 1 or 2"),
        (lambda d: d.pop("format"), "key 'format' is missing"),
    ],
)
def test_a_malformed_script_is_refused_with_its_place(change, place):
    with pytest.raises(InvalidInputError, match=place) as caught:
        script(change)
    assert str(caught.value).startswith("trial.json: ")


def test_infinity_by_way_of_a_large_exponent_is_refused():
    text = json.dumps(SCRIPT).replace('"transition_concentration": 1e-06', '"transition_concentration": 1e999')
    with pytest.raises(InvalidInputError, match="1e999 is not a finite number"):
        read_script(text)


def test_an_unknown_engine_is_refused():
    with pytest.raises(UnknownNameError, match="'magic'; expected one of: bayes-filter, enumeration, gibbs, gtsam"):
        replay(script(), "magic")
