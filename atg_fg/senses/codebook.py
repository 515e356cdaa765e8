r"""An open-ended mixture of appearance classes, shared by all objects and all slots.

In a calibrated space (``feature_space.py``) the mean of a class is m ~ N(0, diag ψ), and a look at it z ~ N(m, σ²). Of
n looks with the sum s, in each direction, and with v = ψ/σ²,

* the next look has p(z | class) = N(z; v s / (1 + n v), σ² (1 + v / (1 + n v))),
* and all of them together have
  ln p(z_1:n) = −½ [n ln 2πσ² + ln(1 + n v) + (Σ z² − v s² / (1 + n v)) / σ²].

Looks fall into classes as guests sit down in a Chinese restaurant: into one with n looks with weight n, into one never
met with weight γ. A tag is the class without noise: one of which all looks are the same point.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from atg_fg.core.checks import GREATEST, finite_array, floats, number, whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.log_math import log_sum_exp
from atg_fg.core.patterns import MISSING, FloatArray, IntArray

#: Classes that a codebook can have, at most.
MOST_CLASSES: Final = 1000
_LOG_TAU: Final = float(np.log(2 * np.pi))
#: Rounds of moving looks, of merging and of splitting; they end before if nothing changes.
_MOST_ROUNDS: Final = 8


class Posterior(NamedTuple):
    """What a look says of its class.

    Attributes:
        classes: p(class | z) of each number, shape [V]; 0 of those without looks.
        new: p(a class never met | z).
    """

    classes: FloatArray
    new: float


class Codebook:
    """Classes by number, each with the looks that fell into it.

    Args:
        between: ψ, shape [D].
        most: V, the numbers that there are, at most ``MOST_CLASSES``.
        within: σ².
        concentration: γ.

    Raises:
        InvalidInputError: A variance that is not above 0, or a number out of range.

    Attributes:
        counts: n of each class, shape [V]; 0 where there is no class.
        sums: s of each, shape [V, D].
    """

    def __init__(self, between: ArrayLike, most: int, *, within: float = 1.0, concentration: float = 1.0) -> None:
        self.between = floats(between, "codebook: between", "variances above 0").copy()
        if (
            self.between.ndim != 1
            or not len(self.between)
            or not ((self.between > 0) & (self.between <= GREATEST)).all()
        ):
            raise InvalidInputError(f"codebook: between {between!r:.60}; expected variances above 0")
        self.most = whole_number(most, "codebook: classes", 1, MOST_CLASSES)
        self.within = number(within, "codebook: within", least=1e-12)
        self.concentration = number(concentration, "codebook: concentration", least=1e-12)
        self.counts = np.zeros(self.most)
        self.sums = np.zeros((self.most, len(self.between)))
        self._ratio = self.between / self.within

    @property
    def n_classes(self) -> int:
        """Classes that have looks."""
        return int(np.count_nonzero(self.counts))

    @property
    def next_number(self) -> int | None:
        """The number that the next new class gets, the least without looks; ``None`` if none is left."""
        free = np.flatnonzero(self.counts == 0)
        return int(free[0]) if len(free) else None

    def copy(self) -> Codebook:
        """Return a codebook that can learn without touching this one."""
        twin = Codebook(self.between, self.most, within=self.within, concentration=self.concentration)
        twin.counts, twin.sums = self.counts.copy(), self.sums.copy()
        return twin

    def add(self, look: FloatArray, number: int, times: float = 1.0) -> None:
        """Let a look of shape [D] fall into a class; ``times`` −1 takes it out again.

        Raises:
            InvalidInputError: A look of another length, not finite, or a class that there is not.
        """
        look = self._checked(look)
        whole_number(number, "codebook: class", 0, self.most - 1)
        if self.counts[number] + times < 0:
            held = f"class {number} has {self.counts[number]:g} looks"
            raise InvalidInputError(f"codebook: {held}; expected {-times:g} that can be taken out")
        self.counts[number] += times
        self.sums[number] += times * look
        if self.counts[number] == 0:
            self.sums[number] = 0.0  # not the rounding errors of what was there

    def log_densities(self, look: FloatArray) -> tuple[FloatArray, float]:
        """Return ln p(z | class) of each number, shape [V], −∞ without looks, and ln p(z | a class never met)."""
        look = self._checked(look)
        grown = 1.0 + self.counts[:, None] * self._ratio
        variance = self.within * (1.0 + self._ratio / grown)
        residual = look - self._ratio * self.sums / grown
        known = -0.5 * (np.log(variance) + residual**2 / variance + _LOG_TAU).sum(axis=1)
        fresh = self.within + self.between
        new = -0.5 * float((np.log(fresh) + look**2 / fresh + _LOG_TAU).sum())
        return np.where(self.counts > 0, known, -np.inf), new

    def likelihood(self, look: FloatArray) -> FloatArray:
        """Return p(z | symbol), scaled so that the greatest is 1, shape [V].

        A class never met may have any of the numbers that are left, and it is a matter of naming which: all that they
        say together stands at the next number.
        """
        known, new = self.log_densities(look)
        free = self.next_number
        if free is not None:
            known[free] = new + np.log(self.most - self.n_classes)
        scaled: FloatArray = np.exp(known - known.max())
        return scaled

    def posterior(self, look: FloatArray) -> Posterior:
        """Return what a look says of its class, by the restaurant's weights."""
        known, new = self.log_densities(look)
        with np.errstate(divide="ignore"):
            weighted = known + np.log(self.counts)
            log_new = new + np.log(self.concentration) if self.next_number is not None else -np.inf
        total = log_sum_exp(np.append(weighted, log_new))
        return Posterior(np.exp(weighted - total), float(np.exp(log_new - total)))

    def log_evidence(self, looks: FloatArray, labels: IntArray) -> float:
        """Return ln p(looks, which fall together), of looks of shape [N, D] and their classes, shape [N]."""
        looks, labels = self._all_checked(looks, labels)
        n_looks = len(labels)
        order = np.arange(n_looks) + self.concentration
        classes = [looks[labels == each] for each in np.unique(labels)]
        seating = len(classes) * np.log(self.concentration) - float(np.log(order).sum())
        return float(seating) + sum(_log_factorial(len(each) - 1) + self._log_marginal(each) for each in classes)

    def _log_marginal(self, looks: FloatArray) -> float:
        return self._log_marginal_of(float(len(looks)), looks.sum(axis=0), (looks**2).sum(axis=0))

    def _log_marginal_of(self, n: float, total: FloatArray, squares: FloatArray) -> float:
        grown = 1.0 + n * self._ratio
        misfit = (squares - self._ratio * total**2 / grown) / self.within
        return -0.5 * float((n * (_LOG_TAU + np.log(self.within)) + np.log(grown) + misfit).sum())

    def refit(self, looks: FloatArray, labels: Sequence[int] | IntArray) -> IntArray:
        """Have the classes that explain all looks best, and return the class of each, shape [N].

        Looks move to other classes, classes merge and split as long as ``log_evidence`` grows. A class keeps the number
        that most of its looks had. The result depends on the arguments alone.

        Args:
            looks: All that there are, shape [N, D].
            labels: The class of each so far, ``MISSING`` of those without one, shape [N].
        """
        looks, given = self._all_checked(looks, labels)
        current = given.copy()
        self._fill(looks, current)
        for _ in range(_MOST_ROUNDS):
            changed = self._move(looks, current)
            changed = self._merge(looks, current) or changed
            changed = self._split(looks, current) or changed
            if not changed:
                break
        current = _renumbered(current, given, self.most)
        self._fill(looks, current)
        return current

    def _checked(self, look: FloatArray) -> FloatArray:
        """Return a look as an array of shape [D]; of one that is an array already, next to no time is spent."""
        is_array = isinstance(look, np.ndarray) and look.dtype == np.float64 and look.shape == self.between.shape
        if is_array and np.abs(look).max() <= GREATEST:
            return look
        return finite_array(look, "look", self.between.shape, f"{len(self.between)} numbers, as in the codebook")

    def _all_checked(self, looks: FloatArray, labels: Sequence[int] | IntArray) -> tuple[FloatArray, IntArray]:
        expected = f"looks of {len(self.between)} numbers, as in the codebook"
        found = finite_array(looks, "looks", (None, len(self.between)), expected)
        classes = [
            whole_number(label, f"labels[{index}]", MISSING, self.most - 1) for index, label in enumerate(labels)
        ]
        if len(classes) != len(found):
            raise InvalidInputError(f"labels: {len(classes)}; expected one for each of {len(found)} looks")
        return found, np.array(classes, dtype=np.int64)

    def _fill(self, looks: FloatArray, labels: IntArray) -> None:
        self.counts, self.sums = np.zeros_like(self.counts), np.zeros_like(self.sums)
        placed = labels != MISSING
        np.add.at(self.counts, labels[placed], 1.0)
        np.add.at(self.sums, labels[placed], looks[placed])

    def _move(self, looks: FloatArray, labels: IntArray) -> bool:
        """Take each look out in turn, and put it where it is most probable."""
        before = labels.copy()
        for index, look in enumerate(looks):
            if labels[index] != MISSING:
                self.add(look, int(labels[index]), -1.0)
            belief, free = self.posterior(look), self.next_number
            best = int(belief.classes.argmax())
            new = free is not None and belief.new > belief.classes[best]
            labels[index] = free if new and free is not None else best
            self.add(look, int(labels[index]))
        return bool((labels != before).any())

    def _merge(self, looks: FloatArray, labels: IntArray) -> bool:
        """Merge the two classes that gain most by it, as long as any two gain."""
        changed = False
        while True:
            numbers = np.flatnonzero(self.counts)
            squares = np.array([(looks[labels == each] ** 2).sum(axis=0) for each in numbers])
            alone = [
                self._log_marginal_of(self.counts[c], self.sums[c], q) for c, q in zip(numbers, squares, strict=True)
            ]
            best, pair = 0.0, None
            for first in range(len(numbers)):
                for second in range(first):
                    a, b = numbers[first], numbers[second]
                    together = self._log_marginal_of(
                        self.counts[a] + self.counts[b], self.sums[a] + self.sums[b], squares[first] + squares[second]
                    )
                    sizes = int(self.counts[a]), int(self.counts[b])
                    gain = together - alone[first] - alone[second] + _log_merging(*sizes, self.concentration)
                    if gain > best:
                        best, pair = gain, (int(a), int(b))
            if pair is None:
                return changed
            dropped, kept = sorted(pair, key=lambda each: (self.counts[each], -each))
            labels[labels == dropped] = kept
            self._fill(looks, labels)
            changed = True

    def _split(self, looks: FloatArray, labels: IntArray) -> bool:
        """Part each class along the direction in which it is widest, if both parts alone explain it better."""
        changed = False
        for parted in np.flatnonzero(self.counts):
            free, members = self.next_number, np.flatnonzero(labels == parted)
            if free is None or len(members) < 2:
                continue
            points = looks[members]
            second = _two_means(points)
            if second.all() or not second.any():
                continue
            parts = points[~second], points[second]
            gain = sum(map(self._log_marginal, parts)) - self._log_marginal(points)
            if gain > _log_merging(len(parts[0]), len(parts[1]), self.concentration):
                labels[members[second]] = free
                self._fill(looks, labels)
                changed = True
        return changed


def _log_factorial(n: int) -> float:
    return float(np.log(np.arange(1, n + 1)).sum())


def _log_merging(first: int, second: int, concentration: float) -> float:
    """Return by how much looks rather fall into one class than into two of these sizes, before they are seen."""
    return (
        _log_factorial(first + second - 1)
        - _log_factorial(first - 1)
        - _log_factorial(second - 1)
        - float(np.log(concentration))
    )


def _two_means(points: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Return which points are in the second of two parts, beginning with the halves of the widest direction."""
    centred = points - points.mean(axis=0)
    direction = np.linalg.svd(centred, full_matrices=False)[2][0]
    direction *= np.sign(direction[np.abs(direction).argmax()])  # a sign of its own on each machine
    second = centred @ direction > 0
    for _ in range(10):
        if second.all() or not second.any():
            break
        centres = points[~second].mean(axis=0), points[second].mean(axis=0)
        away = [((points - centre) ** 2).sum(axis=1) for centre in centres]
        moved = away[1] < away[0]
        if (moved == second).all():
            break
        second = moved
    return np.asarray(second)


def _renumbered(labels: IntArray, given: IntArray, most: int) -> IntArray:
    """Return labels such that each class has the number that most of its looks had, the largest overlap first."""
    overlaps = np.zeros((most, most), dtype=np.int64)
    placed = given != MISSING
    np.add.at(overlaps, (labels[placed], given[placed]), 1)
    number = np.full(most, MISSING, dtype=np.int64)
    order = np.argsort(-overlaps, axis=None, kind="stable")
    for now, before in zip(*np.unravel_index(order, overlaps.shape), strict=True):
        if not overlaps[now, before]:
            break
        if number[now] == MISSING and before not in number:
            number[now] = before
    left = iter([each for each in range(most) if each not in number])
    for now in dict.fromkeys(labels.tolist()):
        if number[now] == MISSING:
            number[now] = next(left)
    renumbered: IntArray = number[labels]
    return renumbered
