import json
import sys

import pytest

from atg_fg import __version__
from atg_fg.cli import doctor
from atg_fg.cli.doctor import GROUP, Finding, diagnose, libraries


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


PLANTED = """
import os, signal

def sound():
    print("much talk")
    return "all is well"

def absent():
    import a_library_that_nobody_has

def wrong():
    raise ArithmeticError("2 + 2 = 5")

def crash():
    os.kill(os.getpid(), signal.SIGSEGV)
"""


@pytest.fixture
def planted(tmp_path, monkeypatch):
    """Checks of another package, installed beside this one."""
    (tmp_path / "planted_checks.py").write_text(PLANTED)
    information = tmp_path / "planted_checks-1.0.dist-info"
    information.mkdir()
    names = ("sound", "absent", "wrong", "crash")
    lines = [f"planted {name} = planted_checks:{name}" for name in names]
    (information / "entry_points.txt").write_text("\n".join([f"[{GROUP}]", *lines]))
    (information / "METADATA").write_text("Metadata-Version: 2.1\nName: planted_checks\nVersion: 1.0\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}:{':'.join(filter(None, sys.path))}")


def test_what_is_there_works():
    findings = {finding.subject: finding for finding in diagnose()}
    for subject in ("Python", "gtsam", "numpy", "inference", "pybullet", "camera and detection", "robot"):
        assert findings[subject].status == "works", findings[subject]
    assert findings["gtsam"].required
    assert not findings["pybullet"].required


@pytest.mark.slow
def test_each_way_to_fail_is_told_apart(planted):
    found = {each.subject: (each.status, each.detail) for each in diagnose()}
    assert found["planted sound"] == ("works", "all is well")
    assert found["planted absent"] == ("missing", "No module named 'a_library_that_nobody_has'")
    assert found["planted wrong"] == ("broken", "ArithmeticError: 2 + 2 = 5")
    assert found["planted crash"] == ("broken", "the interpreter was ended by signal 11")


def test_a_missing_library_is_named_with_what_to_do(monkeypatch):
    installed = doctor._installed
    monkeypatch.setattr(doctor, "_installed", lambda name: None if name == "pybullet" else installed(name))
    (finding,) = (each for each in libraries() if each.subject == "pybullet")
    assert (finding.status, finding.detail, finding.required) == ("missing", "pip install 'atg-fg[sim]'", False)


def test_an_old_library_is_named_with_what_was_expected(monkeypatch):
    installed = doctor._installed
    monkeypatch.setattr(doctor, "_installed", lambda name: "1.9" if name == "numpy" else installed(name))
    (finding,) = (each for each in libraries() if each.subject == "numpy")
    assert (finding.status, finding.detail, finding.required) == ("broken", "1.9; expected >=2.0", True)
