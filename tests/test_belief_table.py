import numpy as np
import pytest

from atg_fg.belief import IdentityBelief
from atg_fg.engines import begin_trial
from atg_fg.errors import InvalidInputError, UnknownNameError
from atg_fg.memory import RobotMemory
from atg_fg.parameters import ModelParameters
from tests.small import graph, one_slot, trial
from tests.test_html_table import Reader

BELIEF = IdentityBelief(np.array([0.1, 0.5, 0.05, 0.15]), 0.2, 6)
NAMES = ("cup", "box", "<lid>", "lock")


def test_the_best_objects_come_first_then_all_others_then_unseen():
    rows = BELIEF.named(NAMES, shown=2).table().rows
    assert [row[0] for row in rows] == ["box", "lock", "2 others", "unseen (6 never met)"]
    assert [row[1].share for row in rows] == pytest.approx([0.5, 0.15, 0.15, 0.2])
    assert [str(row[1]) for row in rows] == ["0.500", "0.150", "0.150", "0.200"]


def test_entropy_and_verdict_are_said():
    assert f"entropy {BELIEF.entropy:.3f} nats; judged known, box" in str(BELIEF.named(NAMES))
    novel = IdentityBelief(np.array([0.4]), 0.6, 3)
    assert "judged novel" in str(novel.named(["cup"]))
    assert "judged novel" in str(IdentityBelief(np.array([]), 1.0, 3).named([]))


def test_probabilities_go_by_name():
    table = BELIEF.named(NAMES)
    assert (table["box"], table["<lid>"], table.unseen, len(table)) == (0.5, 0.05, 0.2, 4)
    assert list(table) == [("box", 0.5), ("lock", 0.15), ("cup", 0.1), ("<lid>", 0.05)]
    with pytest.raises(UnknownNameError, match="belief: unknown name 'pot'"):
        table["pot"]


def test_a_notebook_shows_names_as_they_are():
    assert "<lid>" in Reader(BELIEF.named(NAMES)._repr_html_()).texts


def test_a_belief_without_names_shows_indices():
    assert "object 1" in Reader(BELIEF._repr_html_()).texts


def test_an_engine_knows_the_names():
    assumptions = one_slot(3, 2, 3)
    memory = RobotMemory(assumptions, [graph(assumptions, "cup", [(0,)]), graph(assumptions, "box", [(1,)])])
    inference = trial("bayes-filter", memory, ModelParameters(0.0, 0.0), 0)
    table = inference.belief_table(shown=1)
    assert table["cup"] == inference.identity().objects[0] > table["box"]
    assert [row[0] for row in table.table().rows] == ["cup", "1 other", "unseen (1 never met)"]
    assert begin_trial("gtsam", memory, ModelParameters()).belief_table()["cup"] == pytest.approx(1 / 3)


@pytest.mark.parametrize(("names", "shown"), [(("cup",), 2), (NAMES, 0)])
def test_other_names_and_no_rows_are_refused(names, shown):
    with pytest.raises(InvalidInputError, match="expected"):
        BELIEF.named(names, shown)
