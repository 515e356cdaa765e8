"""The five-minute job: from an empty environment and a table of one's own to a page of what was recognised."""

import json
import os
import subprocess
import venv
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from tests.report.chromium import Page, browser, need_chromium

ROOT = Path(__file__).parents[1]
#: The sides of three mugs: four around, the lid and the base.
MUGS = {
    "breakfast": ("handle", "sun", "plain", "sun", "rim", "foot"),
    "office": ("handle", "logo", "plain", "stripe", "rim", "foot"),
    "camping": ("dent", "stripe", "logo", "logo", "rim", "tin"),
}


def mugs(n_trials, seed):
    """Return a table of trials: turn goes round the four sides, tip to the lid, the base, and back."""
    rng = np.random.default_rng(seed)
    rows = ["trial;step;action;seen;object"]
    for trial in range(n_trials):
        name = list(MUGS)[int(rng.integers(3))]
        place = int(rng.integers(6))
        for step in range(8):
            action = ("turn", "tip")[int(rng.integers(2))]
            seen = "" if rng.random() < 0.05 else MUGS[name][place]
            rows.append(f"mug {trial};{step};{action if step < 7 else ''};{seen};{name}")
            turned = (place + 1) % 4 if place < 4 else place
            place = turned if action == "turn" else {4: 5, 5: 0}.get(place, 4)
    return "\n".join(rows) + "\n"


@pytest.fixture(scope="module")
def program(tmp_path_factory):
    """Install the package, with pages, in an empty environment; return a function that runs its command there."""
    folder = tmp_path_factory.mktemp("empty")
    venv.create(folder / "environment", with_pip=True)
    programs = folder / "environment" / "bin"
    bare = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}

    def run(name, *arguments, cwd=folder):
        done = subprocess.run(
            [programs / name, *map(str, arguments)], cwd=cwd, env=bare, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, f"{name} {arguments}: {done.stderr}"
        return done.stdout

    run("pip", "install", "--quiet", f"{ROOT}[report]")
    return run


@pytest.mark.slow
def test_a_table_of_ones_own_is_learned_recognised_and_looked_at(program, tmp_path):
    need_chromium()
    (tmp_path / "first.csv").write_text(mugs(20, 0))
    (tmp_path / "next.csv").write_text(mugs(6, 1))
    assert "nothing odd" in program("atg-fg", "recordings", "check", "first.csv", "--objects", 3, cwd=tmp_path)
    program("atg-fg", "learn", "first.csv", "--memory", "robot.db", "--objects", 3, cwd=tmp_path)
    told = ("next.csv", "--memory", "robot.db", "--report", "page.html", "--json", "next.json")
    program("atg-fg", "recognise", *told, cwd=tmp_path)
    found = json.loads((tmp_path / "next.json").read_text())
    assert found["score"]["success"]["rate"] >= 0.8
    with browser() as address:
        page = Page(tmp_path / "page.html", address)
        words = []
        for key in ("Home", "ArrowRight", "End"):
            page.press(key)
            words.append(page.ask("document.getElementById('seen-words').textContent"))
        assert all(word.startswith("seen ") for word in words)
        assert any(one != other for one, other in pairwise(words))
        assert page.errors == []
        assert [url for url in page.requests if not url.startswith("data:")] == [(tmp_path / "page.html").as_uri()]
        page.screenshot(tmp_path / "page.png")
        page.close()
    assert (tmp_path / "page.png").stat().st_size > 10_000
