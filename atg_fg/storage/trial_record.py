"""A trial as JSON lines: a header, a line a look, the verdict."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any, Final

from atg_fg.core.records import TrialRecord
from atg_fg.storage.checked_json import plain_json, without_none
from atg_fg.storage.memory_json import write_assumptions

#: What the first line of a record says that it is.
TRIAL_FORMAT: Final = "atg-fg/trial"


def to_json_lines(record: TrialRecord, pictures: Sequence[Mapping[str, Any]] = (), **header: Any) -> str:
    """Return the record as JSON lines: a header, a line a step, the verdict.

    Args:
        record: The trial.
        pictures: Paths of ``frame`` and ``crops`` of each look, from the record's folder, if there are any.
        header: What else the header says.
    """
    assumptions = write_assumptions(record.assumptions)
    lines: list[dict[str, Any]] = [
        {"format": TRIAL_FORMAT, "version": 1, "objects": record.names, "assumptions": assumptions, **header}
    ]
    lines += [_step_line(record, time) for time in range(len(record.steps))]
    for line, paths in zip(lines[1:], pictures, strict=False):
        line.update(paths)
    verdict = {"outcome": record.verdict, "judged_novel": record.judged_novel, "matched": record.matched}
    mistakes = {"mistakes": [list(each) for each in record.mistakes]} if record.mistakes else {}
    lines.append({"verdict": {**verdict, **mistakes, "truth": record.lost_truth or record.steps[-1].truth}})
    return "".join(json.dumps(line, default=plain_json, allow_nan=False) + "\n" for line in lines)


def _step_line(record: TrialRecord, time: int) -> dict[str, Any]:
    step, actions = record.steps[time], record.assumptions.actions
    bound = step.total_variation_bound
    expected = step.expected_entropies
    line = {
        "step": time,
        "observed": step.detection,
        "objects": step.belief.objects,
        "unseen": step.belief.unseen,
        "entropy": step.belief.entropy,
        "log_evidence": step.log_evidence,
        "expected_entropy": None if expected is None else dict(zip(actions, expected.tolist(), strict=True)),
        "action": None if step.action is None else actions[step.action],
        "purpose": step.purpose,
        "total_variation_bound": bound,
        "truth": step.truth,
    }
    return without_none(line, but_for=("expected_entropy", "action"))
