"""Joint angles of both arms for hypothesis, and the mirror between the arms."""

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

#: Takes left to right.
MIRROR = np.diag([1.0, -1.0, 1.0])

#: Where each joint is between its limits.
shares = arrays(np.float64, (2, 7), elements=st.floats(0, 1))


def within_limits(kinematics, shares):
    return kinematics.lower + shares * (kinematics.upper - kinematics.lower)


def angle_between(a, b):
    return np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), (a * b).sum(axis=-1))
