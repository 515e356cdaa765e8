"""What a page is told of each kind of file."""

import contextlib
import gzip
import json
import math
import random
from pathlib import Path

import pytest

from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.errors import AtgError, InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.experiments.table1 import TestPlan, run_test
from atg_fg.experiments.trial import learn_from
from atg_fg.report.experiments import EXPERIMENTS
from atg_fg.report.reading import read_report
from atg_fg.storage.memory_files import load_memory, open_memory, save_memory
from atg_fg.storage.trial_log import read_log

RESULTS = Path(__file__).parents[2] / "results"


def changed(record, change):
    lines = [json.loads(line) for line in record.read_text().splitlines()]
    change(lines)
    record.write_text("".join(json.dumps(line) + "\n" for line in lines))
    return record


def test_a_record_is_told_look_by_look(trial, record):
    memory, run = trial
    report = read_report(record, memory)
    (page,) = report.trials
    assert (page.verdict, page.right) == ("object-000", None)
    assert [look.seen for look in page.looks] == run.detections
    assert [look.entropy for look in page.looks] == [step.belief.entropy for step in run.steps]
    assert page.looks[-1].objects[0] == ("object-000", float(run.belief.objects[0]))
    assert dict(page.looks[0].expected) == dict(
        zip(("flip", "left", "right"), run.steps[0].expected_entropies.tolist(), strict=True)
    )
    assert report.parameters == {"seed": "1", "preset": "default"}


def test_each_look_points_at_the_graph_of_what_would_be_judged_then(trial, record):
    memory, run = trial
    (page,) = read_report(record, memory).trials
    graphs = [page.graphs[look.graph].name for look in page.looks]
    assert graphs == ["a new object" if step.belief.is_novel else "object-000" for step in run.steps]
    graph = next(graph for graph in page.graphs if graph.name == "object-000")
    remembered = memory["object-000"]
    assert graph.aspects[: graph.remembered] == remembered.aspects
    assert {edge[:3]: edge[3] for edge in graph.edges} == remembered.counts
    seen = {look.seen for look in page.looks if None not in look.seen}
    assert set(graph.aspects) == set(remembered.aspects) | seen


def test_a_test_in_a_database_is_told_as_its_log_is(test_log, tmp_path):
    plan = TestPlan(engine="bayes-filter", n_trials=12, n_actions=6, n_objects=4)
    run_test(plan, 3, tmp_path / "records.db")
    assert read_report(tmp_path / "records.db").trials == read_report(test_log).trials


def test_trials_of_a_database_that_was_not_empty_show_what_each_look_told(trial, tmp_path):
    memory, run = trial
    path = tmp_path / "robot.db"
    with open_memory(path, memory.assumptions) as kept:
        kept.add(memory["object-000"])
        kept.begin_experiment("trial", {"preset": "default"}, 5)
        learn_from(run, kept)
    report = read_report(path)
    (page,) = report.trials
    assert report.parameters == {"seed": "5", "preset": "default"}
    assert page.verdict == "object-000"
    shown = [page.graphs[look.graph].name for look in page.looks]
    believed = [step.belief.objects[0] > step.belief.unseen for step in run.steps]
    assert shown == ["object-000" if known else "a new object" for known in believed]
    assert not believed[0]
    assert believed[-1]
    assert [look.entropy for look in page.looks] == [step.belief.entropy for step in run.steps]
    assert [value for _, value in page.looks[0].expected] == run.steps[0].expected_entropies.tolist()


def test_a_memory_that_was_empty_at_first_is_retold_with_beliefs_and_what_was_right(run, tmp_path):
    robot = tmp_path / "robot.db"
    open_memory(robot, arcube_assumptions()).close()
    about = ("--engine", "bayes-filter", "--preset", "default", "--actions", "6")
    for seed in (1, 0, 1):
        assert run("trial", "--memory", robot, "--save-memory", robot, "--seed", seed, *about)[0] == 0
    first, second, third = read_report(robot).trials
    assert [page.right for page in (first, second, third)] == [True, True, True]
    assert (first.verdict, third.verdict) == ("a new object", "object-000")
    assert third.truth == f"object-000 ({first.truth.split(',')[0]}), met before"
    assert read_report(robot).notes == ()
    for look in third.looks:
        assert sum(share for _, share in look.objects) + look.unseen == pytest.approx(1.0, abs=1e-9)
    assert third.looks[-1].objects[0][0] == "object-000"


def test_a_memory_that_was_not_empty_at_first_is_retold_from_what_it_held_then(run, tmp_path):
    robot, about = tmp_path / "robot.json", ("--engine", "bayes-filter", "--preset", "default", "--actions", "6")
    for seed in (2, 3):
        given = ("--memory", robot) if robot.exists() else ()
        assert run("trial", *given, "--save-memory", robot, "--seed", seed, *about)[0] == 0
    at_first = load_memory(robot)
    robot = tmp_path / "robot.db"
    save_memory(at_first, robot)
    for seed, record in ((1, "new"), (2, "known"), (1, "again")):
        kept = ("--record", tmp_path / f"{record}.jsonl")
        assert run("trial", "--memory", robot, "--save-memory", robot, "--seed", seed, *kept, *about)[0] == 0
    report = read_report(robot)
    assert report.notes == ()
    for page, record in zip(report.trials, ("new", "known", "again"), strict=True):
        (alone,) = read_report(tmp_path / f"{record}.jsonl").trials
        assert page.verdict == alone.verdict
        for look, recorded in zip(page.looks, alone.looks, strict=True):
            assert dict(look.objects) == pytest.approx(dict(recorded.objects), abs=1e-9)
    new, known, again = report.trials
    # Whether an object of before the records is right, nobody can say; of those in the records, they can.
    assert (new.right, known.right, again.right) == (None, None, True)
    assert "in none of the trials before" in known.truth
    assert (new.verdict, known.verdict, again.verdict) == ("a new object", "object-000", "object-002")


def test_a_new_object_has_the_entropy_of_the_verdict(trial, record, test_log):
    memory, step = trial[0], trial[1].steps[0]
    (page,) = read_report(record).trials
    parts = [*step.belief.objects.tolist(), step.belief.unseen]  # never met is one state of the verdict
    assert page.looks[0].verdict_entropy == pytest.approx(-sum(p * math.log(p) for p in parts if p), abs=1e-12)
    assert len(memory) == 1
    first, *others = read_report(test_log).trials
    assert {look.verdict_entropy for look in first.looks} == {0.0}  # a robot that remembers nothing is sure
    assert max(look.verdict_entropy for page in others for look in page.looks) > 0.1


def test_whether_the_first_trial_of_all_is_right_can_be_told(tmp_path, run):
    record = tmp_path / "trial.jsonl"
    assert run("trial", "--engine", "bayes-filter", "--actions", "2", "--record", record)[0] == 0
    (page,) = read_report(record).trials
    assert (page.verdict, page.right) == ("a new object", True)


@pytest.mark.parametrize("name", ["memory.json", "memory.npz", "memory.db"])
def test_a_memory_is_a_gallery_of_its_graphs(trial, tmp_path, name):
    save_memory(trial[0], tmp_path / name)
    report = read_report(tmp_path / name)
    (drawn,) = report.gallery
    graph = trial[0]["object-000"]
    assert (drawn.name, drawn.aspects, drawn.remembered) == (graph.name, graph.aspects, graph.n_known)
    assert {edge[:3]: edge[3] for edge in drawn.edges} == graph.counts
    assert report.trial_data()["gallery"][0]["name"] == "object-000"


def test_an_empty_memory_is_no_gallery(tmp_path):
    save_memory(RobotMemory(arcube_assumptions()), tmp_path / "memory.json")
    with pytest.raises(InvalidInputError, match="no objects; expected at least one"):
        read_report(tmp_path / "memory.json")


def test_a_database_without_trials_or_objects_is_refused(tmp_path):
    open_memory(tmp_path / "robot.db", arcube_assumptions()).close()
    with pytest.raises(InvalidInputError, match="no trials; expected at least one"):
        read_report(tmp_path / "robot.db")


def test_without_a_memory_the_graph_is_of_the_trial_and_a_note_says_so(record):
    report = read_report(record)
    assert {graph.name for graph in report.trials[0].graphs} == {"what the trial has shown"}
    assert report.trials[0].graphs[0].remembered == 0
    assert "--memory" in report.notes[0]


def test_a_record_without_assumptions_is_of_arcubes(record):
    changed(record, lambda lines: lines[0].pop("assumptions"))
    assert read_report(record).assumptions.actions == ("flip", "left", "right")


def test_what_a_test_leaves_out_is_inferred_again(test_log):
    report = read_report(test_log)
    _, summaries = read_log(test_log)
    assert len(report.trials) == len(summaries) == 12
    assert report.notes == ()
    assert report.title == f"A test of 12 trials, {sum(page.right for page in report.trials)} of them right"
    for page, summary in zip(report.trials, summaries, strict=True):
        # The recorded figures are shown as they are; the inferred objects make up what is left of them.
        assert [look.unseen for look in page.looks] == summary["unseen"]
        for look in page.looks:
            assert sum(share for _, share in look.objects) + look.unseen == pytest.approx(1.0, abs=1e-9)
        chosen = [dict(look.expected)[look.action] for look in page.looks if look.action]
        least = [min(dict(look.expected).values()) for look in page.looks if look.action]
        assert chosen == pytest.approx(least, abs=1e-9)
    known = [page for page in report.trials if page.verdict.startswith("object-")]
    assert known
    for page in known:
        assert page.graphs[page.looks[-1].graph].name == page.verdict
        assert page.looks[-1].objects[0][0] == page.verdict


def test_a_belief_that_does_not_lead_to_what_was_recorded_is_not_shown(test_log, tmp_path):
    lines = [json.loads(line) for line in gzip.decompress(test_log.read_bytes()).splitlines()]
    lines[6]["unseen"][1] = 0.123  # the first line is the header
    other = tmp_path / "test-0003.jsonl.gz"
    other.write_bytes(b"".join(gzip.compress(json.dumps(line).encode() + b"\n") for line in lines))
    report = read_report(other)
    assert [bool(page.looks[0].objects) for page in report.trials[4:7]] == [True, False, False]
    assert "not inferred again" in report.notes[0]


def test_probable_mistakes_and_mended_verdicts_are_told(test_log, record, tmp_path):
    lines = [json.loads(line) for line in gzip.decompress(test_log.read_bytes()).splitlines()]
    lines[5]["mistakes"] = [[4, 0, 0.934]]  # the first line is the header
    lines[9]["mended"] = [[2, "object-001", "object-000"]]
    other = tmp_path / "test-0003.jsonl.gz"
    other.write_bytes(b"".join(gzip.compress(json.dumps(line).encode() + b"\n") for line in lines))
    pages = read_report(other).trials
    assert pages[4].notes == ("Look 4, front, was probably a mistake: 93%.",)
    assert pages[2].notes == ("This verdict was mended after trial 8: from object-001 to object-000.",)
    assert pages[8].notes == ("The verdict of trial 2 was mended after this one: from object-001 to object-000.",)
    assert not any(page.notes for number, page in enumerate(pages) if number not in (2, 4, 8))
    lines[9]["mended"] = [[9, "object-001", "object-000"]]
    other.write_bytes(b"".join(gzip.compress(json.dumps(line).encode() + b"\n") for line in lines))
    with pytest.raises(InvalidInputError, match="trial 8: mended: 9; expected less than 9"):
        read_report(other)
    changed(record, lambda lines: lines[-1]["verdict"].update(mistakes=[[1, 1, 0.8]]))
    (page,) = read_report(record).trials
    assert page.notes == ("Look 1, top, was probably a mistake: 80%.",)


def test_whether_a_trial_was_right_is_by_the_truth():
    report = read_report(RESULTS / "robonaut" / "worn_default" / "test-0000.jsonl.gz")
    result = json.loads((RESULTS / "table1_robonaut_worn_default.json").read_text())
    assert sum(page.right for page in report.trials) == round(100 * result["tests"][0]["success"])


def test_a_run_has_a_trial_a_station_with_its_goal(goal_run):
    report = read_report(goal_run)
    served = json.loads(gzip.decompress(goal_run.read_bytes()))["served"]
    assert [page.goal for page in report.trials] == [tuple(entry["goal"]) for entry in served]
    assert all(page.right for page in report.trials)
    assert {look.purpose for page in report.trials for look in page.looks} >= {"recognise"}


@pytest.mark.parametrize(
    ("result", "tables", "plots"),
    [
        ("table1_paper", 2, 1), ("figure3_default", 1, 1), ("ablation", 4, 4), ("ablation_other_worlds", 4, 4),
        ("goal_learned", 2, 1), ("compare", 1, 1), ("rescore_learned", 1, 1), ("calibrate_gibbs", 1, 1),
        ("reliability_worn", 2, 2),
    ],
)  # fmt: skip
def test_a_result_becomes_tables_and_plots(result, tables, plots):
    report = read_report(RESULTS / f"{result}.json")
    assert (len(report.tables), len(report.plots)) == (tables, plots)
    assert all(len(row) == len(table.headings) for table in report.tables for row in table.rows)
    for plot in report.plots:
        for point in (point for series in plot.series for point in series.points if point.low is not None):
            assert 0 <= point.low <= point.y <= point.high <= 100


def test_the_figures_of_a_result_are_those_of_the_file():
    table = read_report(RESULTS / "table1_paper.json").tables[0]
    assert table.rows[2] == ("success", "79.4 %", "78.1–80.6 %", "0.8 %")
    points = read_report(RESULTS / "figure3_paper.json").plots[0].series[0].points
    assert (points[0].x, points[0].y, points[0].low) == (4.0, pytest.approx(67.8), pytest.approx(64.8, abs=0.05))


def test_every_result_of_the_repository_has_a_page():
    files = [path for path in RESULTS.glob("*.json") if json.loads(path.read_text()).get("command") in EXPERIMENTS]
    assert len(files) >= 30
    for path in files:
        assert read_report(path).tables, path


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda lines: lines[1].pop("entropy"), "line 2: key 'entropy' is missing"),
        (lambda lines: lines[2].update(entropy=True), "line 3: entropy: True; expected a finite number"),
        (lambda lines: lines[2].update(unseen=1.5), "line 3: unseen: 1.5; expected a finite number from 0 to 1"),
        (lambda lines: lines[1].update(objects=[0.1, 0.2]), "line 2: objects: 2 entries; expected 1"),
        (lambda lines: lines[1].update(observed=[3, 99]), "line 2: observed"),
        (lambda lines: lines[1].update(observed="front"), "line 2: observed: 'front'; expected a list"),
        (lambda lines: lines[1].update(action="jump"), "line 2: action: 'jump'; expected one of: flip, left, right"),
        (lambda lines: lines[1].update(expected_entropy=[1]), "line 2: expected_entropy"),
        (lambda lines: lines[0].update(version=2), "line 1: version: 2; expected 1"),
        (lambda lines: lines[-1].clear(), "key 'verdict' is missing"),
        (lambda lines: lines.__delitem__(slice(1, None)), "1 lines; expected a header, a line a look and the verdict"),
    ],
)
def test_a_fault_in_a_record_is_named(record, change, message):
    changed(record, change)
    with pytest.raises(InvalidInputError) as refusal:
        read_report(record)
    assert f"{record}: " in str(refusal.value)
    assert message in str(refusal.value)


def test_another_memory_is_refused(trial, record):
    changed(record, lambda lines: lines[0].update(objects=["other"]))
    with pytest.raises(InvalidInputError, match=r"--memory: 1 objects; expected the memory of the trial, .* other"):
        read_report(record, trial[0])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "not valid JSON"),
        (b"{", "not valid JSON"),
        (b"[1]", "says neither a command nor a format"),
        (b'{"format": "atg-fg/memory"}', "key 'version' is missing"),
        (b'{"format": "atg-fg/preset"}', "is of 'atg-fg/preset'; expected a trial's record"),
        (b'{"command": "table1"}', "expected a result that atg-fg table1 --json wrote"),
        (b'{"command": "figure3", "points": [{"actions": "x"}]}', "expected a result that atg-fg figure3"),
        (b"\xff\xfe", "not UTF-8"),
        (b"\x1f\x8b\x08 broken", "cannot be read"),
        (gzip.compress(b'{"format": "atg-fg/goal-run", "version": 1}'), "key 'served' is missing"),
        (gzip.compress(b'{"format": "atg-fg/test", "version": 1}\n'), "no trials; expected at least one"),
        (gzip.compress(b'{"format": "atg-fg/test", "version": 1, "world": "os:x"}\n') + gzip.compress(b"{}\n"),
         "is no world of this package"),
        (gzip.compress(b'{"format": "atg-fg/test", "version": 1}\n') + gzip.compress(b"{}\n"),
         "trial 0: key 'verdict' is missing"),
        (b"[" * 100_000, "not valid JSON"),
    ],
    ids=lambda value: value if isinstance(value, str) else "file",
)  # fmt: skip
def test_a_file_of_another_kind_is_refused(tmp_path, content, message):
    path = tmp_path / "file"
    path.write_bytes(content)
    with pytest.raises(InvalidInputError) as refusal:
        read_report(path)
    assert str(path) in str(refusal.value)
    assert message in str(refusal.value)


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(InvalidInputError, match="absent: cannot be read"):
        read_report(tmp_path / "absent")


VALUES = (None, True, -1, 1.5, 10**30, "x", "", [], {}, [None], {"a": 1}, [1, 2, 3], -5.0)


def places(value, path=()):
    yield path
    if isinstance(value, (dict, list)):
        for key in list(value) if isinstance(value, dict) else range(min(len(value), 3)):
            yield from places(value[key], (*path, key))


def with_a_fault(document, rng):
    """Return a document in which one value anywhere is another one, or is gone."""
    broken = json.loads(json.dumps(document))
    *way, last = rng.choice([path for path in places(broken) if path])
    holder = broken
    for key in way:
        holder = holder[key]
    if rng.random() < 0.25:
        del holder[last]
    else:
        holder[last] = rng.choice(VALUES)
    return broken


@pytest.mark.parametrize("kind", ["record", "test_log", "goal_run", "table1_paper", "compare", "goal_learned"])
def test_any_fault_in_any_file_is_one_error_or_none(kind, request, tmp_path):
    rng = random.Random(kind)
    if kind in ("record", "test_log", "goal_run"):
        content = request.getfixturevalue(kind).read_bytes()
        packed = content.startswith(b"\x1f\x8b")
        text = gzip.decompress(content).decode() if packed else content.decode()
        document = [json.loads(line) for line in text.splitlines()][:4]
    else:
        packed, document = False, [json.loads((RESULTS / f"{kind}.json").read_text())]
    path = tmp_path / "broken"
    for _ in range(60):
        lines = [json.dumps(line).encode() + b"\n" for line in with_a_fault(document, rng)]
        path.write_bytes(b"".join(map(gzip.compress, lines) if packed else lines))
        with contextlib.suppress(AtgError):
            read_report(path)


@pytest.mark.parametrize("world", ["prism", "lid-box"])
def test_tests_of_other_worlds_are_read_too(world, run, tmp_path):
    quick = ["--engine", "bayes-filter", "--tests", "1", "--trials", "3", "--actions", "3", "--jobs", "1"]
    assert run("table1", "--world", world, *quick, "--records", tmp_path)[0] == 0
    report = read_report(tmp_path / "test-0000.jsonl.gz")
    assert len(report.trials) == 3
    assert all(look.objects or number == 0 for number, page in enumerate(report.trials) for look in page.looks)
