"""Files that were crafted: each gives a page, or one line; never a traceback, a hang or a blank chart."""

import gzip
import json
import math
import random
import re
from pathlib import Path

import pytest

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.errors import AtgError
from atg_fg.report.page import page
from atg_fg.report.reading import read_report
from atg_fg.storage.memory_json import write_assumptions
from tests.cli.conftest import run as run  # a fixture
from tests.work import lines_run

RESULTS = Path(__file__).parents[2] / "results"
DEEP = json.loads("[" * 900 + "]" * 900)
#: What no reader expects where it expects a number, a text or a list.
VALUES = {
    "huge": 10**400, "large": 1e308, "small": 1e-320, "negative": -1.0, "above one": 1.5, "truth": True, "none": None,
    "text": "x", "half a character": "\ud800", "deep": DEEP, "list": [1, 2, 3], "object": {"a": 1}, "empty": [],
}  # fmt: skip


def ways(value, way=()):
    """Yield the way to each value in a document, to the first few of a list."""
    if way:
        yield way
    if isinstance(value, (dict, list)):
        for key in value if isinstance(value, dict) else range(min(len(value), 2)):
            yield from ways(value[key], (*way, key))


def changed(document, way, value):
    """Return a copy with another value at the end of a way."""
    copy = json.loads(json.dumps(document))
    holder = copy
    for key in way[:-1]:
        holder = holder[key]
    holder[way[-1]] = value
    return copy


def is_told_or_refused(path):
    """Check that a file gives a page of finite numbers, or an error that names it; return whether it is a page."""
    message = ""
    try:
        report = read_report(path)
    except AtgError as error:
        message = str(error)
    if message:
        assert message.startswith(f"{path}: ")
        assert len(message) < 1500
        return False
    page(report).encode()
    json.dumps(report.trial_data(), allow_nan=False)
    for plot in report.plots:
        points = [point for series in plot.series for point in series.points]
        assert points
        assert all(math.isfinite(each) for point in points for each in (point.x, point.y))
    return True


def some_values(rng):
    """Return the names of three of the values, so that each place has a few and all are somewhere."""
    return [VALUES[name] for name in rng.sample(list(VALUES), 3)]


@pytest.mark.parametrize(
    "result", ["table1_paper", "figure3_paper", "goal_learned", "compare", "rescore_learned", "calibrate_gibbs",
               "reliability_worn", "ablation_other_worlds"],
)  # fmt: skip
@pytest.mark.parametrize("n", [10, pytest.param(50, marks=pytest.mark.slow)])
def test_a_result_with_any_value_anywhere(result, n, tmp_path):
    document = json.loads((RESULTS / f"{result}.json").read_text())
    path, rng = tmp_path / "result.json", random.Random(result)
    told = []
    all_ways = list(ways(document))
    for way in rng.sample(all_ways, min(n, len(all_ways))):
        for value in some_values(rng):
            path.write_text(json.dumps(changed(document, way, value)))
            told.append(is_told_or_refused(path))
    assert not all(told)


@pytest.mark.parametrize("kind", ["record", "test_log", "goal_run"])
@pytest.mark.parametrize("n", [40, pytest.param(1000, marks=pytest.mark.slow)])
def test_a_record_with_any_value_anywhere(kind, n, request, tmp_path):
    content = request.getfixturevalue(kind).read_bytes()
    packed = content.startswith(b"\x1f\x8b")
    text = gzip.decompress(content).decode() if packed else content.decode()
    lines = [json.loads(line) for line in text.splitlines()]
    lines = lines[:2] if kind == "test_log" else [*lines[:3], lines[-1]] if kind == "record" else lines
    path, rng = tmp_path / "record", random.Random(kind)
    told = []
    all_ways = [way for way in ways(lines) if len(way) > 1]
    for way in rng.sample(all_ways, min(n, len(all_ways))):
        for value in some_values(rng):
            whole = [json.dumps(line).encode() + b"\n" for line in changed(lines, way, value)]
            path.write_bytes(b"".join(map(gzip.compress, whole) if packed else whole))
            told.append(is_told_or_refused(path))
    assert not all(told)


def test_an_action_that_was_never_drawn_has_a_row_without_a_rate(tmp_path):
    document = json.loads((RESULTS / "reliability_worn.json").read_text())
    document["by_action"]["flip"] = {"count": 0, "of": 0, "rate": None, "interval95": None}
    (tmp_path / "result.json").write_text(json.dumps(document))
    report = read_report(tmp_path / "result.json")
    assert ("flip", "0 of 0", "–", "–") in report.tables[0].rows
    assert all(any(series.points for series in plot.series) for plot in report.plots)


def test_a_result_of_nothing_is_refused_rather_than_a_blank_chart(tmp_path):
    (tmp_path / "result.json").write_text('{"command": "figure3", "points": []}')
    with pytest.raises(AtgError, match="no results; expected at least one"):
        read_report(tmp_path / "result.json")


@pytest.mark.parametrize("exponent", ["1e999", "-1e999"])
def test_a_number_without_bounds_is_refused(record, exponent):
    lines = record.read_text().splitlines()
    lines[1] = re.sub(r'"unseen": [0-9.]+', f'"unseen": {exponent}', lines[1])
    record.write_text("\n".join(lines))
    with pytest.raises(AtgError, match=f"line 2: not valid JSON: {exponent} is not a finite number"):
        read_report(record)


def test_a_picture_behind_a_circle_of_links_is_refused(record, tmp_path):
    (tmp_path / "a.png").symlink_to(tmp_path / "b.png")
    (tmp_path / "b.png").symlink_to(tmp_path / "a.png")
    lines = [json.loads(line) for line in record.read_text().splitlines()]
    lines[1]["frame"] = "a.png"
    record.write_text("".join(json.dumps(line) + "\n" for line in lines))
    with pytest.raises(AtgError, match="line 2: frame"):
        read_report(record)


def test_separators_of_lines_that_are_no_line_feed_belong_to_a_text(record):
    lines = [json.loads(line) for line in record.read_text().splitlines()]
    lines[0]["preset"] = "mine\u2028of\u2029two\x85lines"
    record.write_text("".join(json.dumps(line, ensure_ascii=False) + "\n" for line in lines))
    assert read_report(record).parameters["preset"] == lines[0]["preset"]


def long_trial(looks, path):
    """Write the record of a trial of many looks."""
    header = {"format": "atg-fg/trial", "version": 1, "objects": []}
    steps = [
        {"step": time, "observed": [time % 12, (time + 1) % 12], "objects": [], "unseen": 1.0, "entropy": 4.6,
         "log_evidence": -1.0, "expected_entropy": dict.fromkeys(("flip", "left", "right"), 4.6),
         "action": "left" if time < looks - 1 else None, "truth": {"object": 3}}
        for time in range(looks)
    ]  # fmt: skip
    end = {"verdict": {"outcome": "novel", "judged_novel": True, "matched": None, "truth": {"object": 3}}}
    lines = [{**header, "assumptions": write_assumptions(arcube_assumptions())}, *steps, end]
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))


def test_a_trial_of_many_looks_takes_work_that_grows_as_the_looks_do(tmp_path):
    took = []
    for looks in (200, 1_600):
        long_trial(looks, tmp_path / "long.jsonl")
        report, work = lines_run(read_report, tmp_path / "long.jsonl")
        assert len(report.trials[0].looks) == looks
        took.append(work)
    assert took[1] < 8 * 2 * took[0]  # 64 times, if each look went over all of them


def test_rescoring_a_log_of_nothing_but_a_header_is_one_line(run, tmp_path):
    path = tmp_path / "test.jsonl.gz"
    path.write_bytes(gzip.compress(b'{"format": "atg-fg/test", "version": 1, "seed": 0}\n'))
    status, _, errors = run("rescore", path)
    assert (status, errors) == (2, f"atg-fg: {path}: no trials; expected at least one\n")
