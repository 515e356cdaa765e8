"""Ten scripted trials, drawn at random: small enough for enumeration, and each another size and kind of model."""

from __future__ import annotations

import json
import random
from typing import Any

from tests.unchanged.running import DATA


def write_scripts() -> None:
    """Draw the scripts ``script-0.json`` to ``script-9.json``."""
    for number in range(10):
        text = json.dumps(_script(number, random.Random(number))) + "\n"
        (DATA / "inputs" / f"script-{number}.json").write_text(text)


def _script(number: int, draw: random.Random) -> dict[str, Any]:
    """Return a script: objects that are known in part, looks of any symbols, some of them not seen."""
    n_aspects, n_symbols, actions = 3 + number % 3, 4 + number % 2, ["flip", "left", "right"][: 1 + number % 3]
    slots = ["front", "top"]
    patterns = [[first, second] for first in range(n_symbols) for second in range(n_symbols) if first != second]
    objects = [
        _graph(f"object-{each}", draw, patterns, n_aspects, actions) for each in range(min(number, 1 + number % 3))
    ]
    known = [pattern for graph in objects for pattern in graph["aspects"]] or patterns
    steps: list[dict[str, Any]] = []
    for look in range(3 + number % 2):
        steps += [{"act": draw.choice(actions)}] if look else []
        shown = draw.choice(known if draw.random() < 0.7 else patterns)
        steps.append({"observe": [symbol if draw.random() < 0.85 else None for symbol in shown]})
    return {
        "format": "atg-fg/scripted-trial",
        "version": 1,
        "assumptions": {
            "n_objects": 3 + number,
            "n_aspects": n_aspects,
            "actions": actions,
            "slots": slots,
            "n_symbols": n_symbols,
        },
        "parameters": {
            "transition_concentration": draw.choice([1e-8, 1e-3, 0.5]),
            "observation_noise": draw.choice([1e-8, 1e-3, 0.05]),
            "learn_in_trial": number % 2 == 1,
        },
        "memory": objects,
        "steps": steps,
    }


def _graph(
    name: str, draw: random.Random, patterns: list[list[int]], n_aspects: int, actions: list[str]
) -> dict[str, Any]:
    n_known = draw.randrange(1, n_aspects + 1)
    edges = [(source, action, target) for source in range(n_known) for action in actions for target in range(n_known)]
    tried = sorted(draw.sample(edges, min(len(edges), 2 * n_known)))
    return {
        "name": name,
        "aspects": draw.sample(patterns, n_known),
        "transitions": [{"from": s, "action": a, "to": t, "count": draw.randrange(1, 4)} for s, a, t in tried],
    }
