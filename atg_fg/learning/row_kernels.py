"""Loops that begin the rows of the filter over pose and contents, and sum them up in the end, compiled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from atg_fg.core.patterns import FloatArray, IntArray
from atg_fg.inference.kernels.compilation import compiled
from atg_fg.learning.kernels import add_share, copy_into
from atg_fg.learning.pose_kernels import Rows, show
from atg_fg.learning.rates import FAILED

#: A row that is by no more than this above one half is not preferred to the others.
EVEN = 1e-3


@compiled
def first_rows(
    contents: FloatArray, n_poses: int, first: IntArray, first_weights: FloatArray, n_actions: int, repeat: float
) -> tuple[Rows, FloatArray]:
    """Return the rows before the first look, and the probability of each symbol to be shown, shape [H, P, S].

    A new object's registers have no names yet, so any pose of a class is as good as another.

    Args:
        contents: What is known of each owner's registers, shape [H, P, S]; all zero for a new object.
        n_poses: Of the structure.
        first: The first pose of each class, shape [F].
        first_weights: The share of all poses that is in the class, shape [F].
        n_actions: A.
        repeat: κ.
    """
    n_owners, n_rows = len(contents), 0
    shown, begins = np.empty_like(contents), np.empty(n_owners + 1, np.int64)
    is_known = np.zeros(n_owners, np.bool_)
    for each in range(n_owners):
        begins[each] = n_rows
        for probability in contents[each].flat:
            is_known[each] = is_known[each] or probability != 0
        n_rows += n_poses if is_known[each] else len(first)
        show(contents[each], repeat, shown[each])
    begins[n_owners] = n_rows
    owner, start, pose = np.empty(n_rows, np.int64), np.zeros(n_rows, np.int64), np.empty(n_rows, np.int64)
    weight, table = np.empty(n_rows), np.empty(n_rows, np.int64)
    for each in range(n_owners):
        for row in range(begins[each], begins[each + 1]):
            place = row - begins[each]
            owner[row] = table[row] = each
            pose[row], weight[row] = place, 1.0 / n_poses
            if not is_known[each]:
                start[row], pose[row], weight[row] = place, first[place], first_weights[place]
    return (owner, start, pose, weight, table, np.zeros((n_rows, FAILED + n_actions))), shown


@compiled
def expected_events(rows: Rows, n_owners: int) -> FloatArray:
    """Return the expected numbers of each owner, columns as ``atg_fg.learning.rates`` has them, [H, FAILED]."""
    owner, _, _, weight, _, events = rows
    expected = np.zeros((n_owners, FAILED))
    for row in range(len(owner)):
        for event in range(FAILED):
            expected[owner[row], event] += weight[row] * events[row, event]
    return expected


@compiled
def learned_contents(rows: Rows, contents: FloatArray, n_owners: int) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the table of each owner's most probable row if it is more so than all others, else their mean, [H, P, S].

    And which owners have a row at all, shape [H]: the others have been ruled out.
    """
    owner, _, _, weight, table, _ = rows
    total, best = np.zeros(n_owners), np.full(n_owners, -1)
    for row in range(len(owner)):
        each = owner[row]
        total[each] += weight[row]
        if best[each] < 0 or weight[row] > weight[best[each]]:
            best[each] = row
    learned = np.zeros((n_owners, contents.shape[1], contents.shape[2]))
    for each in range(n_owners):
        if best[each] >= 0 and weight[best[each]] > (0.5 + EVEN) * total[each]:
            copy_into(learned[each], contents[table[best[each]]])
            total[each] = -1.0
    for row in range(len(owner)):
        if total[owner[row]] > 0:
            add_share(weight[row] / total[owner[row]], contents[table[row]], learned[owner[row]])
    return learned, best >= 0
