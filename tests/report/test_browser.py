"""The page in a browser: stepped through by keys, without a complaint on its console or a request to anywhere."""

import base64
import json
from pathlib import Path

import pytest

from atg_fg.report.page import write_report
from atg_fg.report.reading import read_report
from atg_fg.storage.memory_files import save_memory
from tests.report.chromium import Page, browser, need_chromium
from tests.report.conftest import NASTY
from tests.report.test_crafted import long_trial

PIXEL = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
RESULTS = Path(__file__).parents[2] / "results"


@pytest.fixture(scope="module")
def chromium():
    need_chromium()
    with browser() as address:
        yield address


@pytest.fixture
def opened(tmp_path, chromium):
    """Make the page of a file and open it; at the end, nothing must have gone wrong in it."""
    pages = []

    def called(path, memory=None, **options):
        file = tmp_path / "page.html"
        write_report(read_report(path, memory), file)
        pages.append(Page(file, chromium, **options))
        return pages[-1]

    yield called
    for page in pages:
        errors, requests = page.errors, [url for url in page.requests if not url.startswith("data:")]
        page.close()
        assert errors == []
        assert requests == [(tmp_path / "page.html").resolve().as_uri()]


def shown(page):
    return page.ask("document.getElementById('position').value")


def test_keys_step_through_a_trial(trial, record, opened):
    memory, run = trial
    page = opened(record, memory)
    looks = [shown(page)]
    for key in ("ArrowRight", "ArrowRight", "ArrowLeft", "End", "ArrowRight", "Home", "ArrowLeft"):
        page.press(key)
        looks.append(shown(page))
    assert looks == [f"look {look} of 4" for look in (0, 1, 2, 1, 4, 4, 0, 0)]
    page.press("End")
    front, top = run.steps[4].detection
    assert f"front {front}, top {top}" in page.ask("document.getElementById('seen-words').textContent")
    assert page.ask("document.querySelectorAll('#graph .halo').length") == 1
    assert page.ask("document.querySelectorAll('#graph .edge.now').length") == 1
    assert page.ask("document.querySelector('#graph-title').textContent") == "object-000"
    bold = page.ask("document.querySelector('#belief .value.best').textContent")
    assert bold == f"{100 * run.belief.objects[0]:.1f} %"


def test_the_slider_has_the_focus_by_tab_and_takes_the_same_keys(record, opened):
    page = opened(record)
    for _ in range(10):
        page.press("Tab")
        if page.ask("document.activeElement.id") == "look":
            break
    assert page.ask("document.activeElement.id") == "look"
    assert page.ask("getComputedStyle(document.activeElement).outlineStyle") == "solid"
    page.press("ArrowRight")
    assert page.ask("document.activeElement.getAttribute('aria-valuetext')") == "look 1 of 4"
    page.press("End")
    assert shown(page) == "look 4 of 4"
    assert "Look 4 of 4" in page.ask("document.getElementById('spoken').textContent")


def test_the_chosen_action_is_lit(trial, record, opened):
    page = opened(record, trial[0])
    run = trial[1]
    lit = page.ask("document.querySelector('#expected .best').textContent")
    assert lit == f"{run.assumptions.actions[run.steps[0].action]} – chosen"
    assert page.ask("document.querySelectorAll('#expected .fill').length") == 3


def test_names_cannot_break_the_page(nasty_record, opened):
    page = opened(nasty_record)
    for _ in range(4):
        page.press("ArrowRight")
    assert page.ask("document.title") == "A trial, look by look"
    assert page.ask("document.images.length") == 0
    names = page.ask("[...document.querySelectorAll('#belief .name')].map((each) => each.textContent)")
    assert NASTY in names


def test_a_test_has_a_chooser_of_its_trials(test_log, opened):
    page = opened(test_log)
    report = read_report(test_log)
    assert page.ask("document.getElementById('trial').options.length") == 12
    page.ask("document.getElementById('next-trial').click()")
    assert page.ask("document.getElementById('trial').value") == "1"
    assert report.trials[1].truth in page.ask("document.getElementById('verdict').textContent")
    wrong = sum(trial.right is False for trial in report.trials)
    page.ask("document.getElementById('only-wrong').click()")
    assert page.ask("document.getElementById('trial').options.length") == (wrong or 12)


def test_the_verdict_is_told_at_the_last_look_only(test_log, opened):
    page = opened(test_log)
    report = read_report(test_log)
    number = next(n for n, trial in enumerate(report.trials) if trial.verdict.startswith("object-") and trial.right)
    page.ask(f"drawTrial({number})")
    told = "document.getElementById('verdict').textContent"
    assert page.ask(told).startswith("so far")
    page.ask(f"stepTo({len(report.trials[number].looks) - 1})")
    assert page.ask(told).startswith(f"✓ rightThe robot says: {report.trials[number].verdict}. Truth: ")
    offered = page.ask("[...document.getElementById('trial').options].map((each) => each.textContent)")
    assert offered[number] == f"✓ trial {number}"


def test_crops_are_drawn_in_place_of_symbols(trial, record, opened, tmp_path):
    """One pixel stands for each symbol that was seen; those that are remembered alone keep their numbers."""
    lines = [json.loads(line) for line in record.read_text().splitlines()]
    (tmp_path / "pixel.png").write_bytes(base64.b64decode(PIXEL))
    for line in lines[1:-1]:
        line["crops"] = ["pixel.png" if slot == 0 else None for slot in range(2)]
    record.write_text("".join(json.dumps(line) + "\n" for line in lines))
    page = opened(record, trial[0])
    page.press("End")
    seen = {line["observed"][0] for line in lines[1:-1]}
    images = page.ask("document.querySelectorAll('#graph image').length")
    numbers = page.ask("[...document.querySelectorAll('#graph .symbol')].map((each) => Number(each.textContent))")
    assert images > 0
    assert numbers
    assert seen.isdisjoint(numbers)
    assert images + len(numbers) == 2 * page.ask("document.querySelectorAll('#graph title').length")


def test_a_long_trial_is_drawn_with_few_dots(tmp_path, opened):
    long_trial(5_000, tmp_path / "long.jsonl")
    page = opened(tmp_path / "long.jsonl")
    page.press("End")
    assert shown(page) == "look 4999 of 4999"
    assert 300 <= page.ask("document.querySelectorAll('#entropy .h-dot').length") <= 1_000


def test_a_gallery_draws_every_graph(trial, tmp_path, opened):
    save_memory(trial[0], tmp_path / "memory.json")
    page = opened(tmp_path / "memory.json")
    assert page.ask("document.querySelectorAll('#gallery svg').length") == 1
    assert "object-000" in page.ask("document.getElementById('gallery').textContent")


def test_every_look_of_a_goal_run_is_drawn(goal_run, opened):
    page = opened(goal_run)
    for number, trial in enumerate(read_report(goal_run).trials):
        page.ask(f"drawTrial({number})")
        for look in range(len(trial.looks)):
            page.ask(f"stepTo({look})")
            assert page.ask("document.querySelectorAll('#graph svg').length") == 1
    assert "goal: front" in page.ask("document.getElementById('legend').textContent")


@pytest.mark.parametrize("dark", [False, True])
def test_text_stands_out_in_light_and_dark(record, opened, dark):
    page = opened(record, dark=dark)
    pairs = json.loads(page.ask(CONTRASTS))
    assert (sum(pairs[0]["back"]) < 200) is dark
    for pair in pairs:
        assert contrast(pair["text"], pair["back"]) >= 4.5, pair


@pytest.mark.parametrize("width", [360, 1400])
def test_nothing_is_wider_than_the_window(record, opened, width):
    page = opened(record, size=(width, 900))
    assert page.ask("document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize("result", ["table1_paper", "ablation", "compare"])
def test_results_are_drawn(result, opened):
    page = opened(RESULTS / f"{result}.json")
    assert page.ask("document.querySelectorAll('table tbody tr').length") > 5
    assert page.ask("document.querySelectorAll('figure circle').length") > 5


#: Colour of text and of what is behind it, of all texts outside drawings.
CONTRASTS = """
(() => {
  const numbers = (color) => color.match(/[\\d.]+/g).map(Number);
  const behind = (node) => {
    for (; node; node = node.parentElement) {
      const color = numbers(getComputedStyle(node).backgroundColor);
      if (color.length === 3 || color[3] === 1) return color.slice(0, 3);
    }
    return [255, 255, 255];
  };
  const texts = [...document.querySelectorAll("p, h1, h2, h3, dt, dd, span, li, output, button, td, th")];
  return JSON.stringify(texts.filter((node) => node.textContent.trim() && !node.disabled).map((node) =>
    ({ words: node.textContent, text: numbers(getComputedStyle(node).color).slice(0, 3), back: behind(node) })));
})()
"""


def contrast(text, back):
    """Return the contrast ratio of two sRGB colours, as the Web Content Accessibility Guidelines define it."""

    def luminance(color):
        shares = [value / 255 for value in color]
        linear = [share / 12.92 if share <= 0.04045 else ((share + 0.055) / 1.055) ** 2.4 for share in shares]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    light, dark = sorted((luminance(text), luminance(back)), reverse=True)
    return (light + 0.05) / (dark + 0.05)
