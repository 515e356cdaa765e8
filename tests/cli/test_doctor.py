import json

from atg_fg import __version__
from atg_fg.doctor import Finding


def test_what_works_is_shown_and_written(run, monkeypatch, tmp_path):
    found = [Finding("gtsam", "works", "4.3.0", required=True), Finding("pybullet", "missing", "pip install it")]
    monkeypatch.setattr("atg_fg.cli.doctor.diagnose", lambda: found)
    status, output, _ = run("doctor", "--json", tmp_path / "doctor.json")
    assert status == 0
    assert "pip install it" in output
    document = json.loads((tmp_path / "doctor.json").read_text())
    assert [each["status"] for each in document["findings"]] == ["works", "missing"]


def test_a_broken_core_ends_with_1(run, monkeypatch):
    monkeypatch.setattr("atg_fg.cli.doctor.diagnose", lambda: [Finding("gtsam", "broken", "signal 11", required=True)])
    assert run("doctor")[0] == 1


def test_the_version_is_said(run):
    assert run("--version") == (0, f"atg-fg {__version__}\n", "")
