"""Recordings of many rows, columns and names: time and memory stay what their size explains."""

import json
import subprocess
import sys
import time

import pytest

from atg_fg.core.errors import InvalidInputError
from atg_fg.storage.recordings import RecordingSpec, read_recording

READ = """
import resource, sys
from atg_fg.storage.recordings import read_recording
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
recording = read_recording(sys.argv[1])
after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(len(recording.trials), sum(len(trial.looks) for trial in recording.trials), (after - before) // 1024)
"""


@pytest.mark.slow
def test_a_million_rows_are_read_in_bounded_memory(tmp_path):
    pytest.importorskip("resource")
    rows = (
        f"{trial},{step},{'turn' if step < 9 else ''},l{(7 * trial + step) % 50},0.{(trial + step) % 90 + 10}"
        for trial in range(100_000)
        for step in range(10)
    )
    path = tmp_path / "looks.csv"
    path.write_text("trial,step,action,label,label:confidence\n" + "\n".join(rows) + "\n")
    done = subprocess.run([sys.executable, "-c", READ, path], capture_output=True, text=True, check=True)
    n_trials, n_looks, mebibytes = map(int, done.stdout.split())
    assert (n_trials, n_looks) == (100_000, 1_000_000)
    assert mebibytes < 600  # about 210 where it was written


class TestLargeInput:
    """No more time than the size explains, and no message that fills a screen."""

    def message_of(self, path, lines, **spec):
        path.write_text("\n".join(lines) + "\n")
        with pytest.raises(InvalidInputError) as error:
            read_recording(path, RecordingSpec(**spec))
        assert len(str(error.value)) < 2000 + len(str(path))
        return str(error.value)

    @pytest.mark.parametrize("n_digits", [19, 400, 5000])
    def test_a_step_of_many_digits_is_none(self, tmp_path, n_digits):
        rows = ["trial,step,action,seen", f"t,{'9' * n_digits},x,cup", "t,1,,lid"]
        assert "line 2, column 'step'" in self.message_of(tmp_path / "r.csv", rows)

    def test_twenty_thousand_columns_are_told_apart_at_once(self, tmp_path):
        slots = [f"s{number}" for number in range(20_000)]
        header, row = ",".join(["trial,step,action", *slots]), ",".join(["t,0,", *["x"] * 20_000])
        begun = time.process_time()
        path = tmp_path / "wide.csv"
        path.write_text(f"{header}\n{row}\n")
        assert read_recording(path).slots == tuple(slots)
        assert "and 19979 others" in self.message_of(path, [header.replace("trial,", "trail,"), row])
        assert "and 19976 others" in self.message_of(path, [header + ",odd:confidence", row + ",1"])
        assert time.process_time() - begun < 5

    def test_of_many_names_the_first_are_told(self, tmp_path):
        labels = tuple(f"label-{number}" for number in range(10_000))
        rows = ["trial,step,action,seen", "t,0,x,none", "t,1,,none"]
        assert "label-0, label-1, label-10," in self.message_of(tmp_path / "r.csv", rows, labels=labels)
        header = {"format": "atg-fg/recording", "version": 1, "slots": ["seen"], "labels": labels, "actions": labels}
        for trial in (
            {"trial": "t", "actions": [], "looks": [["none"]]},
            {"trial": "t", "actions": ["none"], "looks": [["label-0"]] * 2},
        ):
            self.message_of(tmp_path / "r.jsonl", [json.dumps(header), json.dumps(trial)])
