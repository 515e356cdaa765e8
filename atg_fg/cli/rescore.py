"""``atg-fg rescore``: recorded tests judged by another model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from atg_fg.cli import options
from atg_fg.experiments.document_tables import tables_of
from atg_fg.experiments.rescore import rescore as judged_anew
from atg_fg.experiments.scores import SCORES, pooled_interval
from atg_fg.storage.recorded_test import recorded_tests


def rescore(
    files: Annotated[list[Path], options.argument(help="Tests that table1 --records wrote: logs or a database.")],
    preset: options.Preset = "learned",
    engine: options.PresetsEngine = None,
    json_file: options.JsonFile = None,
) -> None:
    """Judge recorded tests once more, from the same looks and actions, by another model.

    Example: atg-fg rescore results/robonaut/nominal_default/test-0000.jsonl.gz --preset learned
    """
    parameters, engine = options.model_of(preset, engine, "bayes-filter")
    recorded = [test for file in files for test in recorded_tests(file)]
    results = {test.place: judged_anew(test, engine, parameters) for test in recorded}
    tests = [
        {
            "file": file,
            **{name: list(getattr(result, name)) for name in SCORES},
            "interval95": list(pooled_interval([result], "success")),
        }
        for file, result in results.items()
    ]
    document = {"command": "rescore", "parameters": {"preset": preset, "engine": engine}, "tests": tests}
    if options.write_json(document, json_file):
        options.print_tables(tables_of(document), f"Recorded tests, judged with preset {preset}, engine {engine}")
