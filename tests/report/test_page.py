"""The page as a file: one file, nothing from elsewhere, everything escaped."""

import json
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

from atg_fg.report.page import page, write_report
from atg_fg.report.reading import read_report
from tests.report.conftest import NASTY

RESULTS = Path(__file__).parents[2] / "results"


class Tags(HTMLParser):
    """The start tags of a page with their attributes, and the texts of its scripts."""

    def __init__(self, html):
        super().__init__()
        self.tags, self.scripts, self.open = [], [], []
        self.feed(html)
        self.close()

    def handle_starttag(self, tag, attributes):
        self.tags.append((tag, dict(attributes)))
        self.open.append(tag)

    def handle_endtag(self, tag):
        if tag in self.open:
            while self.open.pop() != tag:
                pass

    def handle_data(self, data):
        if self.open and self.open[-1] == "script":
            self.scripts.append(data)


def policy_of(html):
    return next(attributes["content"] for _, attributes in Tags(html).tags if "http-equiv" in attributes)


def test_a_page_asks_for_nothing_from_elsewhere(record, test_log, goal_run):
    pages = [page(read_report(path)) for path in (record, test_log, goal_run, RESULTS / "ablation.json")]
    for html in pages:
        tags = Tags(html).tags
        addresses = [value for _, attributes in tags for key, value in attributes.items() if key in ("src", "href")]
        assert addresses == ["data:,"]
        assert not re.search(r"(url\(|@import|https?://(?!www\.w3\.org/2000/svg))", html)
        policy = policy_of(html)
        assert policy.startswith("default-src 'none'; img-src data:;")
        assert "unsafe-inline" not in policy.split("script-src")[1]


def test_every_text_is_escaped(nasty_record):
    html = page(read_report(nasty_record))
    found = Tags(html)
    assert "img" not in [tag for tag, _ in found.tags]
    types = [attributes.get("type") for tag, attributes in found.tags if tag == "script"]
    assert types == ["application/json", None, None, None, None, None]
    data = json.loads(found.scripts[0])
    assert data["trials"][0]["verdict"] == NASTY
    assert data["trials"][0]["looks"][0]["purpose"] == NASTY


def test_an_experiment_needs_no_script():
    html = page(read_report(RESULTS / "table1_paper.json"))
    assert "<script" not in html
    assert policy_of(html).endswith("script-src 'none'")
    assert "78.1–80.6 %" in html


def test_plots_have_names_and_their_points_say_their_figures():
    html = page(read_report(RESULTS / "figure3_paper.json"))
    assert 'role="img" aria-label="Success rate by number of actions' in html
    assert "<title>entropy, 4 actions: 67.8 (64.8–70.6)</title>" in html


def test_controls_have_names(test_log):
    tags = Tags(page(read_report(test_log))).tags
    labelled = {attributes.get("for") for tag, attributes in tags if tag == "label"}
    for tag, attributes in tags:
        if tag == "button":
            assert attributes["aria-label"]
        if tag == "input" and attributes["type"] == "range":
            assert attributes["id"] in labelled


def test_the_same_file_makes_the_same_page(record):
    assert page(read_report(record)) == page(read_report(record))


def test_the_command_writes_a_page(run, record, tmp_path):
    status, output, error = run("report", record, "-o", tmp_path / "page.html")
    assert (status, error) == (0, "")
    assert "page.html" in output.replace("\n", "")
    assert (tmp_path / "page.html").read_text().startswith("<!DOCTYPE html>")


def test_what_cannot_be_read_or_written_leaves_the_old_page(refused, record, tmp_path):
    old = tmp_path / "page.html"
    old.write_text("old")
    (tmp_path / "bad.jsonl").write_text(record.read_text().replace('"entropy"', '"entropie"'))
    assert "key 'entropy' is missing" in refused("report", tmp_path / "bad.jsonl", "-o", old)
    assert "cannot be read" in refused("report", tmp_path / "absent", "-o", old)
    assert old.read_text() == "old"
    assert "cannot be written" in refused("report", record, "-o", tmp_path / "no" / "page.html")


def test_without_jinja2_the_extra_is_named(refused, record, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "jinja2", None)
    assert 'pip install "atg-fg[report]"' in refused("report", record, "-o", tmp_path / "page.html")
    assert not (tmp_path / "page.html").exists()


def test_a_page_is_written_whole(record, tmp_path):
    write_report(read_report(record), tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text().rstrip().endswith("</html>")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["page.html", "trial.jsonl"]


@pytest.mark.parametrize("name", ["page.css", "page.html", "trial.html", "plot.svg", "trial.js"])
def test_templates_style_and_scripts_are_in_the_package(name):
    assert (Path(__file__).parents[2] / "atg_fg" / "report" / "data" / name).is_file()
