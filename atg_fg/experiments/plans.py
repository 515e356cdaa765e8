"""What a plan of an experiment says in the headers of its records."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def unusual(plan: DataclassInstance) -> dict[str, Any]:
    """Return what a plan has other than usual: a plan may get more to say, and old records still be gone on with."""
    usual = _described(type(plan)())
    return {name: value for name, value in _described(plan).items() if value != usual[name]}


def _described(plan: DataclassInstance) -> dict[str, Any]:
    description = asdict(plan)
    if not description["parameters"]["learn_structure"]:
        del description["parameters"]["learn_structure"]
    return description
