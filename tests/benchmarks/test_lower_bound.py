import json
import platform

from atg_fg.core.memory import RobotMemory
from benchmarks import machine
from benchmarks.lower_bound import counts, floor
from tests.small import graph, one_slot


def test_bytes_and_logarithms_by_hand():
    world = one_slot(n_objects=3, n_aspects=3, n_symbols=4, actions=("push", "pull"))
    # Of the first object two edges leave one row and lead to two aspects; of the second two lead to one aspect.
    first = graph(world, "first", [(0,), (1,)], (0, 0, 0, 1), (0, 0, 1, 2))
    second = graph(world, "second", [(2,), (3,), (0,)], (0, 1, 2, 1), (1, 1, 2, 1))
    memory = RobotMemory(world, [first, second])
    # States: 3, 4 and 1 of the unseen; rows with an edge: 1 and 2; edges: 4.
    # Logarithms: targets 2 and 1; two for each action and object; one for each action and pattern.
    assert counts(memory) == {"bytes": 8 * 8 + 8 * 3 + 16 * 4, "logarithms": 3 + 2 * 2 * 3 + 2 * 4}


def test_an_empty_memory_has_a_floor_too():
    world = one_slot(n_objects=3, n_aspects=3, n_symbols=4)
    assert counts(RobotMemory(world)) == {"bytes": 8, "logarithms": 0 + 2 + 4}


def test_the_floor_is_the_longer_of_reading_and_logarithms():
    ticks = iter(range(10**6))
    world = one_slot(n_objects=3, n_aspects=3, n_symbols=4)
    found = floor(RobotMemory(world), 5, lambda: float(next(ticks)))
    # Three calls in a second of this clock.
    assert found["a_second"]["logarithms"]["median"] == 3 * machine.N_LOGARITHMS
    assert found["a_second"]["bytes"]["median"] == 3 * machine.LEAST_BYTES
    assert found["milliseconds"]["logarithms"] == 1e3 * 6 / (3 * machine.N_LOGARITHMS)
    assert found["milliseconds"]["floor"] == max(found["milliseconds"]["bytes"], found["milliseconds"]["logarithms"])


def test_the_machine_is_described_but_not_named():
    described = machine.description()
    assert described["processor"]
    assert described["cores"] >= 1
    assert described["packages"]["numpy"]
    assert described["packages"]["gtsam"]
    assert machine.installed_version("no-such-package") is None
    assert platform.node() not in json.dumps(described).split('"')
