"""From measured reliability to the noise that recognition assumes: a preset such as ``robot``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from atg_fg.core.assumptions import MAX_NUMBER
from atg_fg.core.checks import whole_number
from atg_fg.core.errors import InvalidInputError
from atg_fg.core.parameters import ModelParameters
from atg_fg.storage.checked_json import parse_json
from atg_fg.storage.plain_files import read_text_file
from atg_fg.worlds.arcube import N_TAGS

_N_PATTERNS = N_TAGS * (N_TAGS - 1)


@dataclass(frozen=True)
class Counts:
    """What was counted in a reliability run.

    Attributes:
        actions: Actions after which the cube was still there.
        failed: Of these, how many left it in another orientation than they should.
        looks: Looks at the cube.
        wrong: Of these, how many showed a tag that was not there.
        missing: Slots, two a look, in which no tag was detected.
    """

    actions: int
    failed: int
    looks: int
    wrong: int
    missing: int

    def __add__(self, other: Counts) -> Counts:
        return Counts(
            self.actions + other.actions,
            self.failed + other.failed,
            self.looks + other.looks,
            self.wrong + other.wrong,
            self.missing + other.missing,
        )


def calibrate(counts: Counts) -> tuple[ModelParameters, float]:
    """Return model parameters estimated from what was counted, and the rate at which a slot's tag is missing.

    Rates are posterior means under Jeffreys' prior, so that what was never seen to fail is not held to be impossible.

    * Transition: an action fails at rate f if the cube comes to another orientation than it should. An edge seen once
      shall fail as often: α / (1 + α) = f (``docs/model.md``, transition, with one count).
    * Observation: a look shows another pattern at rate e; δ (1 − 1/|Z|) = e.
    * Missing: the share of slots where nothing was detected. It is the same for all patterns, so it cancels in every
      posterior; it is recorded to be known.
    """
    failure, error = _jeffreys(counts.failed, counts.actions), _jeffreys(counts.wrong, counts.looks)
    parameters = ModelParameters(
        transition_concentration=failure / (1 - failure),
        observation_noise=error * _N_PATTERNS / (_N_PATTERNS - 1),
    )
    return parameters, _jeffreys(counts.missing, 2 * counts.looks)


def read_counts(files: Sequence[Path]) -> Counts:
    """Return the counts of the files that ``atg-fg sim reliability --json`` wrote, taken together.

    Raises:
        InvalidInputError: A file that cannot be read or is not such a file.
    """
    total = Counts(0, 0, 0, 0, 0)
    for file in files:
        total += _counts(parse_json(read_text_file(file), str(file)), str(file))
    return total


def _counts(document: Any, place: str) -> Counts:
    def count(*keys: str) -> int:
        value = document
        for key in keys:
            if not isinstance(value, dict) or key not in value:
                where = f"{place}: {'.'.join(keys)} is missing"
                raise InvalidInputError(f"{where}; expected what atg-fg sim reliability --json writes")
            value = value[key]
        return whole_number(value, f"{place}: {'.'.join(keys)}", most=MAX_NUMBER)

    counts = Counts(
        actions=count("success", "of") - count("failures", "lost"),
        failed=count("failures", "stayed") + count("failures", "another_orientation"),
        looks=count("detection", "both", "of"),
        wrong=count("detection", "wrong_ids", "count"),
        missing=count("detection", "one", "count") + 2 * count("detection", "none", "count"),
    )
    if counts.failed > counts.actions or counts.wrong > counts.looks or counts.missing > 2 * counts.looks:
        raise InvalidInputError(f"{place}: {counts}; expected no more failures than there were actions and looks")
    return counts


def _jeffreys(count: int, total: int) -> float:
    """Return the posterior mean of a rate under Jeffreys' prior."""
    return (count + 0.5) / (total + 1)
