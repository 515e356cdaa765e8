"""What a memory knows of appearances as JSON: written and read back, and what damaged files are told."""

import copy
import json

import numpy as np
import pytest

from atg_fg.core.assumptions import Assumptions
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.patterns import PatternAlphabet
from atg_fg.senses.appearance import AppearanceSense
from atg_fg.senses.feature_space import FeatureSpace
from atg_fg.storage.memory_json import memory_from_json, memory_to_document, memory_to_json

ALPHABET = PatternAlphabet(("front", "top"), 6, exclusive=False)


@pytest.fixture
def memory():
    space = FeatureSpace("two", np.array([0.5, 1.0]), np.eye(2), np.array([9.0, 4.0]))
    found = RobotMemory(Assumptions(3, 6, ("turn",), ALPHABET), sense=AppearanceSense(space, ALPHABET, within=0.5))
    name = found.learn([0], [], None)
    found.learn_readings(name, [((0.25, -1.5), None), ((8.0, 8.0), (0.25, -1.25))], [(0, None), (1, 0)], [0])
    return found


def test_a_sense_is_read_as_it_was_written(memory):
    read = memory_from_json(memory_to_json(memory))
    assert read == memory
    assert read.sense.codebook.counts.tolist() == memory.sense.codebook.counts.tolist() == [2, 1, 0, 0, 0, 0]
    assert read.sense.codebook.sums.tolist() == memory.sense.codebook.sums.tolist()


def changed(document, path, value):
    place = document
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] = value
    return document


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (("within",), 0, "sense: codebook: within: 0"),
        (("within",), "x", "sense.within: 'x'; expected a finite number"),
        (("between",), [], r"sense.projection\[0\]: 2 entries; expected 0"),
        (("between", 0), -1, "variances above 0"),
        (("between", 0), 1e200, r"between\[0\]: 1e\+200; expected a finite number"),
        (("mean",), [0.5], "mean: 1 entries; expected 2"),
        (("projection", 0), [1.0], r"projection\[0\]: 1 entries; expected 2"),
        (("features",), "", "features: ''; expected a text"),
        (("trials", 0, "readings", 0), [None], r"trials\[0\].readings\[0\]: 1 entries; expected 2"),
        (("trials", 0, "readings", 0, 0), [1.0], r"readings\[0\]\[0\]: 1 entries; expected 2"),
        (("trials", 0, "readings"), [], r"trials\[0\].readings: 0 looks, 1 actions; expected one look more"),
        (("trials", 0, "classes", 0), [0, 0], r"classes\[0\]: a class where nothing was measured"),
        (("trials", 0, "classes", 0), [9, None], "symbol 9; expected 0 to 5"),
        (("trials", 0, "actions"), ["jump"], "'jump'; expected one of: turn"),
        (("trials", 0, "object"), 3, "object: 3; expected a text"),
        (("trials",), {}, "sense.trials"),
    ],
)
def test_what_is_wrong_is_said_with_its_place(memory, path, value, message):
    document = copy.deepcopy(memory_to_document(memory))
    changed(document["sense"], path, value)
    with pytest.raises(InvalidInputError, match=message):
        memory_from_json(json.dumps(document))


@pytest.mark.parametrize("sizes", [(100_000, 1), (6, 5000)])
def test_a_small_file_cannot_ask_for_tables_without_end(memory, sizes):
    n_symbols, n_dimensions = sizes
    document = copy.deepcopy(memory_to_document(memory))
    document["assumptions"] |= {"slots": ["front"], "n_symbols": n_symbols}
    document["memory"] = []
    ones = [1.0] * n_dimensions
    document["sense"] |= {"mean": [0.0], "projection": [ones], "between": ones, "trials": []}
    with pytest.raises(InvalidInputError, match=r"expected (a whole number from )?1 to 1000"):
        memory_from_json(json.dumps(document))
