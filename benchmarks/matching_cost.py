"""Does a decision of ``large-memory`` cost the same at any size, if the same number of objects knows what is seen?"""

from __future__ import annotations

from functools import partial
from typing import Any, Final

from atg_fg.core.errors import AtgError
from atg_fg.engines import ENGINES
from benchmarks.contestants import LARGE_MEMORY, follow, large_memory
from benchmarks.measuring import Clock, alternate, median_of, ratios, spread
from benchmarks.memories import N_MATCHING, equal_matches, matching_course

PRESET: Final = "default"
N_ACTIONS: Final = 10
#: A trial is short here: each round takes the median of so many.
REPEATS: Final = 5


def measure(small: int, large: int, n_rounds: int, clock: Clock) -> dict[str, Any]:
    """Return what a trial takes at two sizes side by side, or why it was left out."""
    about = {"engine": LARGE_MEMORY, "preset": PRESET, "sizes": [small, large], "matching": min(N_MATCHING, small)}
    if LARGE_MEMORY not in ENGINES:
        return {**about, "left_out": f"no engine {LARGE_MEMORY!r} is registered"}
    try:
        works = {}
        for size in (small, large):
            memory = equal_matches(size)
            contestant = large_memory(PRESET, memory)
            course = matching_course(memory, N_ACTIONS)
            follow(contestant, course, clock)
            works[str(size)] = partial(
                lambda own, seen: median_of([follow(own, seen, clock) for _ in range(REPEATS)]), contestant, course
            )
    except AtgError as error:
        return {**about, "left_out": str(error)}
    taken = alternate(works, n_rounds)
    for each in taken.values():
        each["decision and step"] = [sum(pair) for pair in zip(each["decision"], each["step"], strict=True)]
    few, many = taken[str(small)], taken[str(large)]
    return {
        **about,
        "n_rounds": n_rounds,
        "rounds": {"small": few, "large": many},
        "milliseconds": {
            name: {quantity: spread([1e3 * each for each in values]) for quantity, values in seconds.items()}
            for name, seconds in (("small", few), ("large", many))
        },
        "ratio": {quantity: spread(ratios(many[quantity], few[quantity])) for quantity in few},
    }
