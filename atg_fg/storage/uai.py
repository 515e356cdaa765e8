"""Discrete factor graphs in the UAI format: a text of whole numbers and tables that many solvers read.

A model file is its kind, the number of variables, their cardinalities, the number of factors, the scope of each, and
then the table of each, the last variable of a scope the fastest. A text is split at white space, so the lines it is
laid out in do not matter. Tools write comments, from # to the end of the line, and text after the last table. An
evidence file says which state which variable is in.
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Callable, Iterable, Mapping
from typing import Final, NoReturn, TypeAlias

import numpy as np

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.patterns import FloatArray
from atg_fg.inference.elimination.discrete_model import KINDS, MAX_SCOPE, DiscreteModel, ModelFactor

_SHOWN: Final = 40
#: Is told what of a text was not read.
Note: TypeAlias = Callable[[str], None]


def _warn(note: str) -> None:
    warnings.warn(note, stacklevel=4)


def read_model(text: str, place: str = "model", note: Note = _warn) -> DiscreteModel:
    """Return the model in a UAI text; text after the last table is ignored, and noted.

    Time and memory are linear in the text: the announced size of a table is compared with its scope and with what is
    left of the text before anything is made of it.

    Raises:
        InvalidInputError: Anything malformed; the message names ``place``, the line and what was expected.
    """
    words = _Words(text, place)
    kind = words.kind()
    n_variables = words.whole("number of variables")
    cardinalities = tuple(words.whole(f"cardinality of variable {index}", 1) for index in range(n_variables))
    n_factors = words.whole("number of factors")
    scopes = [_read_scope(words, f"scope of factor {index}", n_variables) for index in range(n_factors)]
    factors = []
    for index, scope in enumerate(scopes):
        shape = tuple(cardinalities[variable] for variable in scope)
        size = math.prod(shape)
        words.whole(f"size of the table of factor {index}", size, size)
        factors.append(ModelFactor(scope, words.weights(f"table of factor {index}", size).reshape(shape)))
    words.ignore_rest("the last table", note)
    return DiscreteModel(cardinalities, tuple(factors), kind)


def _read_scope(words: _Words, what: str, n_variables: int) -> tuple[int, ...]:
    size = words.whole(f"size of the {what}", 0, min(n_variables, MAX_SCOPE))
    scope: list[int] = []
    for _ in range(size):
        variable = words.whole(f"variable in the {what}", 0, n_variables - 1)
        if variable in scope:
            words.refuse(f"variable in the {what}", "variables that are all different")
        scope.append(variable)
    return tuple(scope)


def write_model(model: DiscreteModel) -> str:
    """Return a model as a UAI text; reading it gives the same numbers again."""
    lines = [model.kind, str(len(model.cardinalities)), _joined(model.cardinalities), str(len(model.factors))]
    lines += [_joined((len(scope), *scope)) for scope, _ in model.factors]
    for _, table in model.factors:
        # Zero is added so that a zero with a sign loses it.
        lines += ["", str(table.size), " ".join(map(repr, (table.ravel() + 0.0).tolist()))]
    return "\n".join(lines) + "\n"


def read_evidence(text: str, place: str = "evidence", note: Note = _warn) -> dict[int, int]:
    """Return the evidence in a UAI text, as the state of each observed variable.

    The later form is the number of observations and then a variable and its state for each: an odd number of words.
    The form of 2008 has the number of samples before that, which must be 1 here: an even number of words. So
    no text can be read both ways. A 0 at the beginning is no evidence, whatever follows; that is noted.

    Whether the variables and states are those of a model is for ``DiscreteModel.check_evidence`` to say.

    Raises:
        InvalidInputError: Anything malformed, several samples, or a variable observed twice.
    """
    words = _Words(text, place)
    if words.begin_with("0"):
        words.ignore_rest("0 observations", note)
        return {}
    if len(words) % 2 == 0:
        words.whole("number of samples", 1, 1)
    evidence: dict[int, int] = {}
    for index in range(words.whole("number of observations")):
        variable = words.whole(f"variable of observation {index}")
        if variable in evidence:
            words.refuse(f"variable of observation {index}", "each variable to be observed once")
        evidence[variable] = words.whole(f"state of observation {index}")
    words.end("the last observation")
    return evidence


def write_evidence(evidence: Mapping[int, int]) -> str:
    """Return evidence as a UAI text in the later form, without a number of samples."""
    return "\n".join([str(len(evidence)), *(_joined(observation) for observation in evidence.items())]) + "\n"


def _joined(numbers: Iterable[int]) -> str:
    return " ".join(map(str, numbers))


class _Words:
    """The words of a text, taken one after the other; errors name the line of the word taken last."""

    def __init__(self, text: str, place: str) -> None:
        self._text = re.sub("#.*", "", text)
        self._place = place
        self._words = self._text.split()
        self._taken = 0

    def __len__(self) -> int:
        return len(self._words)

    def refuse(self, what: str, expected: str) -> NoReturn:
        """Raise ``InvalidInputError`` about the word taken last."""
        raise InvalidInputError(f"{self._place}: line {self._line()}: {what}: {self._shown()}; expected {expected}")

    def _shown(self) -> str:
        word = self._words[self._taken - 1]
        return repr(word if len(word) <= _SHOWN else word[:_SHOWN] + "…")

    def _line(self) -> int:
        for number, word in enumerate(re.finditer(r"\S+", self._text), start=1):
            if number == self._taken:
                return 1 + self._text.count("\n", 0, word.start())
        return 1 + self._text.count("\n")

    def _take(self, what: str) -> str:
        if self._taken == len(self._words):
            raise InvalidInputError(f"{self._place}: the text ends after {self._taken} words; expected the {what}")
        self._taken += 1
        return self._words[self._taken - 1]

    def kind(self) -> str:
        """Return the first word of a model."""
        word = self._take(f"kind of model, {' or '.join(KINDS)}")
        if word not in KINDS:
            self.refuse("kind of model", " or ".join(KINDS))
        return word

    def whole(self, what: str, least: int = 0, most: int | None = None) -> int:
        """Take a whole number from ``least`` to ``most``."""
        word = self._take(what)
        try:
            value = int(word) if _is_plain(word) else least - 1
        except ValueError:
            value = least - 1
        if value < least or (most is not None and value > most):
            bounds = f"of at least {least}" if most is None else f"from {least} to {most}"
            self.refuse(what, str(least) if least == most else f"a whole number {bounds}")
        return value

    def weights(self, what: str, size: int) -> FloatArray:
        """Take ``size`` finite non-negative numbers, shape [size]."""
        left = len(self._words) - self._taken
        if size > left:
            raise InvalidInputError(
                f"{self._place}: the text ends in the {what}, after {left} of its values; expected {size}"
            )
        words = self._words[self._taken : self._taken + size]
        try:
            values = np.array([float(word) for word in words]) if _is_plain("".join(words)) else None
        except ValueError:
            values = None
        if values is None or not (np.isfinite(values).all() and (values >= 0).all()):
            self._taken += 1 + next(index for index, word in enumerate(words) if not _is_weight(word))
            self.refuse(what, "a finite number of at least 0")
        self._taken += size
        return values

    def begin_with(self, word: str) -> bool:
        """Take the first word if it is this one, and return whether it is."""
        begins = self._words[:1] == [word]
        self._taken += begins
        return begins

    def ignore_rest(self, last: str, note: Note) -> None:
        """Tell what follows, if anything does."""
        if self._taken < len(self._words):
            self._taken += 1
            n_words = len(self._words) - self._taken + 1
            note(f"{self._place}: line {self._line()}: {n_words} words after {last} are ignored: {self._shown()}")

    def end(self, last: str) -> None:
        """Refuse whatever follows."""
        if self._taken < len(self._words):
            self._taken += 1
            self.refuse(f"after {last}", "the end of the text")


def _is_plain(word: str) -> bool:
    """Whether Python reads a word as others do: it takes 1_000 and digits of other scripts for numbers, too."""
    return word.isascii() and "_" not in word


def _is_weight(word: str) -> bool:
    try:
        return _is_plain(word) and 0 <= float(word) < math.inf
    except ValueError:
        return False
