from html.parser import HTMLParser

import numpy as np
import pytest

from atg_fg.core.aspect_graph import AspectTransitionGraph
from atg_fg.core.assumptions import Assumptions, arcube_assumptions
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import PatternAlphabet
from atg_fg.core.records import TrialRecord, TrialSummary
from atg_fg.core.table import Bar, Table, shortened
from atg_fg.engines import begin_trial
from atg_fg.experiments.trial import learn_from, run_trial
from atg_fg.learning.believed_structure import BelievedStructure
from atg_fg.learning.shared_structure import SharedStructure
from atg_fg.learning.structured_memory import StructuredMemory
from atg_fg.policies import make_policy
from atg_fg.storage.presets import preset
from atg_fg.worlds.registry import make_world


class Reader(HTMLParser):
    """Collects the texts of an HTML piece, and checks that its tags are closed in order."""

    def __init__(self, html):
        super().__init__()
        self.open, self.texts, self.styles = [], [], []
        self.feed(html)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)
        self.styles += [value for name, value in attrs if name == "style"]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


TABLE = Table("Two cups", ("name", "share"), (("tea", Bar(0.25, "25 %")), ("milk", Bar(1.0, "100 %"))), "a note")


def test_a_notebook_shows_title_headings_cells_and_note():
    assert Reader(TABLE._repr_html_()).texts == ["Two cups", "name", "share", "tea", "25 %", "milk", "100 %", "a note"]


def test_print_shows_the_same_in_columns():
    assert str(TABLE).splitlines() == ["Two cups", "name  share", "tea   25 %", "milk  100 %", "a note"]
    assert repr(TABLE) == str(TABLE)


def test_whatever_is_shown_is_escaped():
    evil = "<script>alert('&')</script>"
    html = Table(evil, (evil,), ((evil,), (Bar(0.5, evil),)), evil)._repr_html_()
    assert "<script>" not in html
    assert Reader(html).texts == [evil] * 5


def test_bars_are_as_long_as_their_share_and_never_longer_than_the_whole():
    for share, width in ((0.25, "25.0%"), (0.0, "0.0%"), (1.0, "100.0%"), (7.0, "100.0%"), (-1.0, "0.0%")):
        html = Table("", ("bar",), ((Bar(share, ""),),))._repr_html_()
        assert f"width: {width}" in html


def test_text_and_ground_keep_the_colours_of_the_theme():
    for style in Reader(TABLE._repr_html_()).styles:
        rules = [rule.strip() for rule in style.split(";")]
        assert not any(rule.startswith("color:") for rule in rules)
        if any(rule.startswith("background") for rule in rules):
            assert "display" in style  # a bar, not a ground under text


def test_without_columns_title_and_note_are_left():
    empty = Table("Nothing", (), (), "a note")
    assert Reader(empty._repr_html_()).texts == ["Nothing", "a note"]
    assert str(empty) == "Nothing\na note"


@pytest.mark.parametrize(("n_rows", "last"), [(2, ("1", "x")), (3, ("2", "x")), (5, ("… and 2 other cups", ""))])
def test_a_long_table_says_how_much_is_left_out(n_rows, last):
    rows = shortened([(str(number), "x") for number in range(n_rows)], 3, "cups")
    assert rows[-1] == last
    assert len(rows) == min(n_rows, 4)


def shown(thing):
    return Reader(thing._repr_html_()).texts


def bell(name="bell"):
    assumptions = Assumptions(3, 4, ("push", "<pull>"), PatternAlphabet(("colour", "sound"), 4))
    graph = AspectTransitionGraph(name, assumptions)
    graph.add_aspect((0, 1))
    graph.add_aspect((2, 3))
    graph.add_transition(0, 0, 1, 2)
    graph.add_transition(0, 0, 0)
    return graph


def test_an_atg_shows_where_each_action_led_from_each_aspect():
    assert shown(bell()) == [
        "bell: 2 of 4 aspects, 2 observed edges",
        *("aspect (colour, sound)", "push", "<pull>"),
        *("(0, 1)", "(0, 1); (2, 3) ×2", "·"),
        *("(2, 3)", "·", "·"),
        "· not yet tried; collection node: 2 unobserved",
    ]


def test_an_empty_atg_shows_that_it_is():
    texts = shown(AspectTransitionGraph("new", arcube_assumptions()))
    assert texts == ["new: 0 of 24 aspects, 0 observed edges", "· not yet tried; collection node: 24 unobserved"]


def test_a_name_is_escaped():
    assert shown(bell("<b>cup</b>"))[0].startswith("<b>cup</b>: 2 of 4")


def test_a_memory_shows_its_objects_and_a_large_one_the_first_of_them():
    graph = bell()
    texts = shown(RobotMemory(graph.assumptions, [graph]))
    assert texts[0] == "Robot memory: 1 of 3 objects"
    assert texts[5:9] == ["bell", "2 of 4", "2", "3"]
    many = RobotMemory(graph.assumptions, [bell(f"bell-{number}") for number in range(1000)])
    assert "… and 988 other objects" in shown(many)
    assert len(shown(many)) < 70


def test_a_memory_says_what_was_merged():
    graph = bell()
    memory = RobotMemory(graph.assumptions, [graph, bell("other")])
    memory.merge("bell", "other")
    assert shown(memory)[-1].endswith("1 merged into others")


def test_an_empty_memory_shows_what_it_takes_for_granted():
    assert shown(RobotMemory(arcube_assumptions())) == [
        "Robot memory: 0 of 100 objects",
        "actions flip, left, right; slots front, top of 12 symbols",
    ]


@pytest.fixture(scope="module")
def records():
    """Two trials with one cube: it is new, then known."""
    memory, found = RobotMemory(arcube_assumptions()), []
    with make_world("ideal") as world:
        for seed in range(2):
            inference = begin_trial("bayes-filter", memory, preset("default"))
            rng, policy = np.random.default_rng(seed), make_policy(("explore", "entropy")[seed])
            record = run_trial(world, inference, policy, (40, 6)[seed], rng, reset_options={"object": 3})
            learn_from(record, memory)
            found.append(record)
    return found


def test_a_trial_shows_each_look_and_how_it_ended(records):
    _, record = records
    texts = shown(record)
    assert texts[0] == "Trial of 6 actions: known, object-000"
    assert texts[texts.index("0") + 1] == str(record.detections[0])
    assert f"{record.belief.objects[0]:.3f}" in texts
    assert [text for text in texts if text in record.assumptions.actions] == [
        record.assumptions.actions[action] for action in record.actions
    ]


def test_a_long_trial_shows_the_first_looks(records):
    assert "… and 1 other looks" in shown(records[0])


def test_a_trial_with_nothing_in_it_shows_that():
    assert shown(TrialRecord((), arcube_assumptions()))[0] == "Trial of 0 actions: nothing seen yet"


def test_on_a_terminal_a_trial_is_one_line(records):
    assert repr(records[1]) == "<Trial of 6 actions: known, object-000>"


def test_an_outcome_shows_what_was_presented_and_seen(records):
    texts = shown(TrialSummary.of(records[1]))
    assert texts[0] == "Trial of 6 actions: known, object-000"
    assert texts[3] == "3"
    assert texts[4].startswith(str(records[1].detections[0]))


def test_a_memory_that_learns_structure_says_what_it_believes(monkeypatch):
    memory = StructuredMemory(arcube_assumptions())
    assert shown(memory)[-1].endswith("; 0 raw trials; structures believed in: none")
    structure = SharedStructure(2, ((1, 0),) * 3)
    believed = [BelievedStructure(structure, weight, np.empty(0), np.empty(0), 1.0) for weight in (0.9, 0.05)]
    monkeypatch.setattr(memory.learner, "believed", lambda names: believed)
    assert shown(memory)[-1].endswith("; 0 raw trials; structures believed in: with weights 0.90, 0.05")
