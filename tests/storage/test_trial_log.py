import gzip
import json
from dataclasses import replace

import numpy as np
import pytest

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.records import Mended, Mistake, TrialSummary
from atg_fg.engines import begin_trial
from atg_fg.experiments.trial import run_trial
from atg_fg.policies import RandomPolicy
from atg_fg.storage.presets import preset
from atg_fg.storage.trial_log import TrialLog, from_line, read_log, to_line
from atg_fg.worlds.registry import make_world

HEADER = {"seed": 3, "world": "ideal"}
ASSUMPTIONS = arcube_assumptions()


def a_record(seed, **world_options):
    inference = begin_trial("bayes-filter", RobotMemory(ASSUMPTIONS), preset("default"))
    return run_trial(make_world("ideal", **world_options), inference, RandomPolicy(), 4, np.random.default_rng(seed))


def lines_of(trials):
    return [json.loads(json.dumps(to_line(trial))) for trial in trials]


def a_log(path, header=HEADER):
    return TrialLog(path, header, ASSUMPTIONS)


@pytest.fixture
def path(tmp_path):
    return tmp_path / "test-0003.jsonl.gz"


@pytest.fixture
def records():
    return [a_record(seed, missing=0.2) for seed in range(3)]


def test_what_is_read_back_is_what_was_written(path, records):
    log = a_log(path)
    assert log.begin() == []
    for record in records:
        log.append(TrialSummary.of(record))
    found = a_log(path).resume()
    assert lines_of(found) == lines_of(map(TrialSummary.of, records))
    assert [trial.patterns for trial in found] == [tuple(record.patterns) for record in records]
    assert [trial.object for trial in found] == [record.steps[0].truth["object"] for record in records]


def test_mistakes_and_mended_verdicts_are_read_back_and_checked():
    trial = replace(TrialSummary.of(a_record(9)), mistakes=(Mistake(2, 1, 0.93),), mended=(Mended(0, "a", "b"),))
    (line,) = lines_of([trial])
    found = from_line(line, "here", ASSUMPTIONS)
    assert (found.mistakes, found.mended) == (trial.mistakes, trial.mended)
    for key, value, message in (
        ("mistakes", [[5, 0, 0.9]], r"here: mistakes\[0\]\[0\]: 5; expected"),
        ("mistakes", [[0, 2, 0.9]], r"here: mistakes\[0\]\[1\]: 2; expected"),
        ("mistakes", [[0, 0, 1.5]], r"here: mistakes\[0\]\[2\]: 1.5; expected"),
        ("mistakes", [[0, 0]], r"here: mistakes\[0\]: 2 entries; expected 3"),
        ("mended", [[-1, "a", "b"]], r"here: mended\[0\]\[0\]: -1; expected"),
        ("mended", [[0, "a", 3]], r"here: mended\[0\]\[2\]: 3; expected"),
    ):
        with pytest.raises(InvalidInputError, match=message):
            from_line({**line, key: value}, "here", ASSUMPTIONS)


def test_paths_of_crops_are_read_back_and_checked():
    trial = TrialSummary.of(a_record(9))
    crops = [("a.png", None), *[()] * (len(trial.steps) - 1)]
    trial = replace(trial, steps=[replace(step, crops=each) for step, each in zip(trial.steps, crops, strict=True)])
    (line,) = lines_of([trial])
    assert [step.crops for step in from_line(line, "here", ASSUMPTIONS).steps] == crops
    for value, message in (
        (["a.png", None], rf"here: crops: 2 entries; expected {len(crops)}"),
        ([["a.png"], *line["crops"][1:]], r"here: look 0: crops: 1 entries; expected 2"),
        ([[7, None], *line["crops"][1:]], r"here: look 0: crops\[0\]: 7; expected a text"),
        (["a.png", *line["crops"][1:]], r"here: look 0: crops: 'a.png'; expected a list"),
    ):
        with pytest.raises(InvalidInputError, match=message):
            from_line({**line, "crops": value}, "here", ASSUMPTIONS)


def test_the_file_is_plain_gzip_with_a_line_a_trial(path, records):
    log = a_log(path)
    log.begin()
    log.append(TrialSummary.of(records[0]))
    header, trial = map(json.loads, gzip.decompress(path.read_bytes()).splitlines())
    assert header == {"format": "atg-fg/test", "version": 1, **HEADER}
    assert trial["actions"] == [ASSUMPTIONS.actions[action] for action in records[0].actions]
    assert [tuple(seen) for seen in trial["observed"]] == [step.detection for step in records[0].steps]
    assert trial["truth"][0]["object"] == records[0].steps[0].truth["object"]
    assert read_log(path)[1] == [trial]


def test_the_same_trials_give_the_same_bytes(tmp_path, records):
    for name in ("a", "b"):
        log = a_log(tmp_path / name)
        log.begin()
        log.append(TrialSummary.of(records[1]))
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


@pytest.mark.parametrize("cut", [1, 10, 50])
def test_half_a_trial_at_the_end_is_cut_off(path, records, cut):
    log = a_log(path)
    log.begin()
    log.append(TrialSummary.of(records[0]))
    sound = path.read_bytes()
    log.append(TrialSummary.of(records[1]))
    whole = path.read_bytes()
    path.write_bytes(whole[:-cut])
    assert lines_of(a_log(path).resume()) == lines_of([TrialSummary.of(records[0])])
    assert path.read_bytes() == sound
    a_log(path).append(TrialSummary.of(records[1]))
    assert path.read_bytes() == whole


def test_a_log_that_is_not_there_is_begun(path):
    assert a_log(path).resume() == []
    assert read_log(path) == (HEADER, [])


def test_a_log_is_never_overwritten(path, records):
    log = a_log(path)
    log.begin()
    log.append(TrialSummary.of(records[0]))
    before = path.read_bytes()
    with pytest.raises(InvalidInputError, match="already there"):
        a_log(path).begin()
    assert path.read_bytes() == before


def test_the_log_of_another_test_is_refused(path):
    a_log(path).begin()
    with pytest.raises(InvalidInputError, match=r"test-0003.*\"seed\": 3.*expected.*\"seed\": 4"):
        a_log(path, {**HEADER, "seed": 4}).resume()


@pytest.mark.parametrize(
    "content",
    [b"not gzip", gzip.compress(b"[1", mtime=0), gzip.compress(b'{"format": "other"}', mtime=0), b""],
    ids=["not gzip", "not JSON", "another format", "empty"],
)
def test_other_files_are_refused_by_name(path, content):
    path.write_bytes(content)
    for read in (a_log(path).resume, lambda: read_log(path)):
        with pytest.raises(InvalidInputError, match=r"test-0003"):
            read()
    assert path.read_bytes() == content


def test_a_trial_without_its_parts_is_refused(path):
    a_log(path).begin()
    with path.open("ab") as file:
        file.write(gzip.compress(b'{"verdict": "novel"}\n'))
    with pytest.raises(InvalidInputError, match=r"trial 0: key .* is missing"):
        a_log(path).resume()
