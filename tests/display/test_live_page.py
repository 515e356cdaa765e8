import json
import queue
import re
import urllib.error
import urllib.request

import numpy as np
import pytest

pytest.importorskip("cv2", reason="OpenCV is not installed: pip install atg-fg[vision]")

from atg_fg.core.errors import InvalidInputError
from atg_fg.display.live_page import LivePage, PageState


@pytest.fixture
def said():
    return queue.Queue()


@pytest.fixture
def page(said):
    with LivePage(0, said) as made:
        yield made


def asked(page, path, body=None, **headers):
    request = urllib.request.Request(page.address + path, data=body, headers=headers)
    with urllib.request.urlopen(request) as answer:
        return answer.read()


def token(page):
    return re.search(r'token = "([^"]+)"', asked(page, "").decode())[1]


def test_the_page_loads_nothing_from_elsewhere(page):
    html = asked(page, "").decode()
    assert html.startswith("<!DOCTYPE html>")
    assert "http" not in html


def test_state_and_picture_are_those_shown_last(page):
    page.show(PageState("now do: flip", "front 1, top 2", (("object-000", 0.75),), "", ("learn",)), None)
    state = json.loads(asked(page, "state"))
    assert (state["say"], state["belief"], state["words"]) == ("now do: flip", [["object-000", 0.75]], ["learn"])
    page.show(PageState(), np.zeros((8, 8, 3), dtype=np.uint8))
    assert json.loads(asked(page, "state"))["number"] == state["number"] + 1
    assert asked(page, "picture.jpg?7").startswith(b"\xff\xd8")


def test_a_button_is_heard(page, said):
    asked(page, "say", b"learn", **{"X-Token": token(page)})
    assert said.get(timeout=5) == "learn"


@pytest.mark.parametrize(
    "request_",
    [
        {"path": "say", "body": b"learn"},
        {"path": "say", "body": b"learn", "X-Token": "guess"},
        {"path": "state", "Host": "evil.example"},
        {"path": "nothing"},
        {"path": "picture.jpg"},
    ],
    ids=["no token", "a wrong token", "another name for this machine", "no such page", "no picture yet"],
)
def test_others_are_turned_away(page, said, request_):
    with pytest.raises(urllib.error.HTTPError, match=r"HTTP Error 40[34]") as refusal:
        asked(page, **request_)
    refusal.value.close()
    assert said.empty()


def test_a_long_word_is_turned_away(page, said):
    with pytest.raises(urllib.error.HTTPError, match="HTTP Error 403") as refusal:
        asked(page, "say", b"x" * 65, **{"X-Token": token(page)})
    refusal.value.close()
    assert said.empty()


def test_a_port_that_is_taken_is_refused(page):
    port = int(page.address.rsplit(":", 1)[1].strip("/"))
    with pytest.raises(InvalidInputError, match=rf"page: port {port}: .*; expected one that is free, 0 for any"):
        LivePage(port, queue.Queue())
