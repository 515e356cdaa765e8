from html.parser import HTMLParser

import pytest

from atg_fg.html_table import Bar, HtmlTable, shortened


class Reader(HTMLParser):
    """Collects the texts of an HTML piece, and checks that its tags are closed in order."""

    def __init__(self, html):
        super().__init__()
        self.open, self.texts, self.styles = [], [], []
        self.feed(html)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)
        self.styles += [value for name, value in attrs if name == "style"]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.texts.append(data)


TABLE = HtmlTable("Two cups", ("name", "share"), (("tea", Bar(0.25, "25 %")), ("milk", Bar(1.0, "100 %"))), "a note")


def test_a_notebook_shows_title_headings_cells_and_note():
    assert Reader(TABLE._repr_html_()).texts == ["Two cups", "name", "share", "tea", "25 %", "milk", "100 %", "a note"]


def test_print_shows_the_same_in_columns():
    assert str(TABLE).splitlines() == ["Two cups", "name  share", "tea   25 %", "milk  100 %", "a note"]
    assert repr(TABLE) == str(TABLE)


def test_whatever_is_shown_is_escaped():
    evil = "<script>alert('&')</script>"
    html = HtmlTable(evil, (evil,), ((evil,), (Bar(0.5, evil),)), evil)._repr_html_()
    assert "<script>" not in html
    assert Reader(html).texts == [evil] * 5


def test_bars_are_as_long_as_their_share_and_never_longer_than_the_whole():
    for share, width in ((0.25, "25.0%"), (0.0, "0.0%"), (1.0, "100.0%"), (7.0, "100.0%"), (-1.0, "0.0%")):
        html = HtmlTable("", ("bar",), ((Bar(share, ""),),))._repr_html_()
        assert f"width: {width}" in html


def test_text_and_ground_keep_the_colours_of_the_theme():
    for style in Reader(TABLE._repr_html_()).styles:
        rules = [rule.strip() for rule in style.split(";")]
        assert not any(rule.startswith("color:") for rule in rules)
        if any(rule.startswith("background") for rule in rules):
            assert "display" in style  # a bar, not a ground under text


def test_without_columns_title_and_note_are_left():
    empty = HtmlTable("Nothing", (), (), "a note")
    assert Reader(empty._repr_html_()).texts == ["Nothing", "a note"]
    assert str(empty) == "Nothing\na note"


@pytest.mark.parametrize(("n_rows", "last"), [(2, ("1", "x")), (3, ("2", "x")), (5, ("… and 2 other cups", ""))])
def test_a_long_table_says_how_much_is_left_out(n_rows, last):
    rows = shortened([(str(number), "x") for number in range(n_rows)], 3, "cups")
    assert rows[-1] == last
    assert len(rows) == min(n_rows, 4)
