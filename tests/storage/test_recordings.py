"""Recordings of a user's own detector: what is read, and what is refused."""

import gzip
import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from atg_fg.core.errors import InvalidInputError
from atg_fg.core.object_sense import ObjectSense
from atg_fg.core.recordings import RecordedLook, RecordedTrial, Recording, used_labels
from atg_fg.storage.recording_csv import CsvReader
from atg_fg.storage.recording_csv_writing import write_csv
from atg_fg.storage.recordings import (
    RecordingSpec,
    check_recording,
    merged_spec,
    read_recording,
    read_spec,
    write_recording,
)

PLAIN = """trial,step,action,label,label:confidence,object
a,0,rotate,logo,0.9,cup
a,1,tip,text,0.5,cup
a,2,,,,cup
b,0,tip,base,0.25,box
b,1,,logo,1,box
"""
TRIALS = (
    RecordedTrial(
        "a",
        (RecordedLook(("logo",), (0.9,)), RecordedLook(("text",), (0.5,)), RecordedLook((None,), (None,))),
        ("rotate", "tip"),
        "cup",
    ),
    RecordedTrial("b", (RecordedLook(("base",), (0.25,)), RecordedLook(("logo",), (1.0,))), ("tip",), "box"),
)


@pytest.mark.parametrize(
    "text",
    [
        PLAIN,
        "\ufeff" + PLAIN,
        PLAIN.replace("\n", "\r\n"),
        PLAIN.replace("\n", "\r", 2).replace("\n", "\r\n", 2),
        PLAIN.replace(".", ",", 3)
        .replace(",", ";")
        .replace("0;9", "0,9")
        .replace("0;5", "0,5")
        .replace("0;25", "0,25"),
        PLAIN.replace(",", "\t"),
        PLAIN.replace("logo", '"logo"').replace("a,1", " a , 1 "),
        PLAIN.replace("\nb,0", "\n\n , ,\nb,0"),
        PLAIN.replace("\n", ",,\n"),
        PLAIN.replace("\n", ",\n").replace("object,", "object", 1),
        PLAIN.replace("0.5,cup", "0.5,").replace(",,,cup", ",,,"),
        PLAIN.encode("utf-16"),
        gzip.compress(PLAIN.encode()),
    ],
)
def test_a_table_is_read_however_it_was_written(written, text):
    recording = read_recording(written(text))
    assert recording.trials == TRIALS
    assert (recording.slots, recording.actions, recording.labels) == (
        ("label",),
        ("rotate", "tip"),
        ("base", "logo", "text"),
    )


@pytest.mark.parametrize("label", ["lo\ngo", "a,b;c\td", '"', "007", "nan", "None", "NA", "#", "=", "a:b", "\x1b[31m"])
def test_a_label_is_what_stands_there_whatever_it_looks_like(written, tmp_path, label):
    text = PLAIN.replace("logo", '"' + label.replace('"', '""') + '"')
    recording = read_recording(written(text.replace("\n", "\r\n")))
    assert recording.trials[0].looks[0].labels == (label,)
    write_recording(recording, tmp_path / "again.csv")
    assert read_recording(tmp_path / "again.csv").trials == recording.trials


def test_names_of_columns_may_hold_other_separators(written):
    text = PLAIN.replace(",", ";").replace("label", '"a,b,c,d,e,f,g"', 1).replace("label:", '"a,b,c,d,e,f,g":', 1)
    assert read_recording(written(text.replace('":confidence', ':confidence"'))).slots == ("a,b,c,d,e,f,g",)


def test_columns_say_what_they_are(written):
    text = "trial,step,action,front,top=a,top=b,front:confidence\n0,0,go,x,0.7,0.3,0.5\n0,1,,,,,\n"
    recording = read_recording(written(text))
    assert recording.slots == ("front", "top")
    assert recording.labels == ("a", "b", "x")
    first, second = recording.trials[0].looks
    assert first == (("x", None), (0.5, None), (None, {"a": 0.7, "b": 0.3}), ())
    assert second.labels == (None, None)
    assert not any(second.weights)


def test_a_column_named_confidence_is_that_of_the_only_slot(written):
    text = "trial,step,action,label,confidence\n0,0,go,x,0.5\n0,1,,y,\n"
    assert read_recording(written(text)).trials[0].looks[0] == (("x",), (0.5,), (), ())
    two = read_recording(written(text.replace("label", "front")), RecordingSpec(slots=("front", "confidence")))
    assert two.trials[0].looks[0].labels == ("x", "0.5")


WEIGHED = """trial,step,action,label,weight:reading,size:reading
a,0,lift,logo,,0
a,1,turn,text,0.5,
a,2,,text,,
b,0,turn,logo,,-1e-3
b,1,,base,2,
"""


def test_a_column_of_readings_is_no_slot(written, tmp_path):
    recording = read_recording(written(WEIGHED))
    assert (recording.slots, recording.sense_names) == (("label",), ("weight", "size"))
    measured = [[look.measured for look in trial.looks] for trial in recording.trials]
    assert measured == [[(("size", 0.0),), (("weight", 0.5),), ()], [(("size", -0.001),), (("weight", 2.0),)]]
    weight, size = recording.assumptions(2).object_senses
    assert (weight.name, weight.relative, weight.revealed_by) == ("weight", True, ("lift",))
    assert (weight.typical, weight.spread) == pytest.approx((1.0, math.log(2.0)))
    assert (size.relative, size.revealed_by) == (False, ())
    semicolons = written(WEIGHED.replace(",", ";").replace(".", ","), "semicolons.csv")
    assert read_recording(semicolons).trials == recording.trials
    for name in ("again.csv", "again.jsonl"):
        write_recording(recording, tmp_path / name)
        again = read_recording(tmp_path / name)
        assert [[look.measured for look in trial.looks] for trial in again.trials] == measured
        assert again.assumptions(2) == recording.assumptions(2)


def test_what_is_known_of_a_sense_goes_before_what_its_readings_say(written, tmp_path):
    known = {"name": "weight", "typical": 1.0, "spread": 0.6, "error": 0.1, "unit": "kg"}
    spec = read_spec(written(json.dumps({"senses": [known, "age"]}), "spec.json"))
    weight = ObjectSense("weight", 1.0, 0.6, 0.1, unit="kg")
    recording = read_recording(written(WEIGHED), spec)
    assert recording.senses == ("size", weight, "age")
    write_recording(recording, tmp_path / "again.jsonl")
    assert read_recording(tmp_path / "again.jsonl").senses == recording.senses
    with pytest.raises(InvalidInputError, match="at most 2 of them"):
        recording.assumptions(2)
    assert weight in read_recording(written(WEIGHED), spec._replace(senses=(weight,))).assumptions(2).object_senses
    with pytest.raises(InvalidInputError, match=r"line 3, column 'weight:reading': '-0\.5'; expected a number above 0"):
        read_recording(written(WEIGHED.replace("text,0.5", "text,-0.5")), spec)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("0.5", "heavy"), "line 3, column 'weight:reading': 'heavy'; expected a number"),
        (("0.5", "nan"), "line 3, column 'weight:reading': 'nan'; expected a number"),
        (("0.5", "1e300"), "line 3, column 'weight:reading': '1e300'; expected a number"),
        (
            ("size:reading", "label:reading"),
            "line 1: column 'label:reading'; expected SLOT:confidence .* SENSE:reading",
        ),
        (("size:reading", ":reading"), "line 1: column ':reading'; expected"),
        (("size:reading", "size:readings"), "line 1: column 'size:readings'; expected"),
        (("step,action,label", "step,action,age:reading"), "line 1: no slot in"),
        (("trial,step,action,label", "trial,step,action,x=a,label:reading"), "line 1: 3 columns of readings"),
    ],
)
def test_a_reading_that_is_none_is_one_line(written, change, message):
    with pytest.raises(InvalidInputError, match=message):
        read_recording(written(WEIGHED.replace(*change, 1)))


def test_a_spec_says_what_rows_do_not(written):
    spec = written(json.dumps({"objects": 3, "actions": ["rotate", "tip", "flip"], "exclusive": True}), "spec.json")
    recording = read_recording(written(PLAIN), merged_spec(RecordingSpec(n_aspects=2), read_spec(spec)))
    assert (recording.n_objects, recording.n_aspects, recording.exclusive) == (3, 2, True)
    assert recording.actions == ("rotate", "tip", "flip")
    assumptions = recording.assumptions()
    assert assumptions.alphabet.names == ("base", "logo", "text")
    assert assumptions.alphabet.is_open
    with pytest.raises(InvalidInputError, match=r"looks\.csv: does not say how many objects there are; expected"):
        read_recording(written(PLAIN)).assumptions()


labels = st.text(st.characters(exclude_categories=("Cs",), exclude_characters="\r"), max_size=5).map(str.strip)
names = labels.filter(lambda text: text and not text.startswith("\ufeff"))


@given(
    st.lists(
        st.tuples(st.lists(st.tuples(st.none() | names, st.none() | st.floats(0, 1)), min_size=1, max_size=4), names),
        min_size=1,
        max_size=3,
    )
)
def test_both_faces_hold_the_same(tmp_path_factory, drawn):
    trials = tuple(
        RecordedTrial(
            f"t{number}",
            tuple(RecordedLook((label,), (sure if label else None,)) for label, sure in looks),
            (action,) * (len(looks) - 1),
        )
        for number, (looks, action) in enumerate(drawn)
    )
    actions, seen = tuple({action for _, action in drawn}), used_labels(trials) or ["nothing"]
    recording = Recording(("label",), actions, tuple(seen), trials)
    folder = tmp_path_factory.mktemp("faces")
    for name in ("looks.csv", "looks.jsonl"):
        write_recording(recording, folder / name)
        again = read_recording(folder / name)
        kept = [[(look.labels, tuple(look.confidences or (None,))) for look in each.looks] for each in again.trials]
        assert kept == [[(look.labels, look.confidences) for look in each.looks] for each in trials]
        assert [each.actions for each in again.trials] == [each.actions for each in trials]


def test_a_confidence_without_a_label_says_nothing_in_either_form(tmp_path):
    (tmp_path / "looks.jsonl").write_text(
        '{"format": "atg-fg/recording", "version": 1, "slots": ["label"], "actions": ["go"], "labels": ["a"]}\n'
        '{"trial": "0", "actions": ["go"], "looks": [["a"], [null]], "confidences": [[0.5], [0.83]]}\n'
    )
    (tmp_path / "looks.csv").write_text("trial,step,action,label,label:confidence\n0,0,go,a,0.5\n0,1,,,0.83\n")
    for name in ("looks.jsonl", "looks.csv"):
        recording = check_recording(tmp_path / name)[0]
        assert [look.confidences for look in recording.trials[0].looks] in ([(0.5,), (None,)], [(0.5,), ()]), name


def test_whole_likelihoods_go_there_and_back(tmp_path):
    look = RecordedLook((None, "b"), (None, None), ({"a": 0.5, "b": 0.25}, None))
    recording = Recording(("front", "top"), ("go",), ("a", "b"), (RecordedTrial("0", (look, look), ("go",), "cup"),))
    for name in ("looks.csv", "looks.jsonl"):
        write_recording(recording, tmp_path / name)
        found = read_recording(tmp_path / name).trials[0]
        assert found.object == "cup"
        assert [dict(each.weights[0]) for each in found.looks] == [{"a": 0.5, "b": 0.25}] * 2
        assert [each.labels for each in found.looks] == [(None, "b")] * 2


NAMES = ("x", "trial", "step", "object", "confidence", "a:b", "a=b", "x:reading", " x", "x ", "x\ry", "x" * 1001, "=")


@pytest.mark.parametrize("part", ["slot", "label", "weighted", "action", "object", "sense", "trial"])
def test_a_table_holds_names_as_they_are_or_is_refused(part):
    refused = []
    for name in NAMES:

        def of(which, usual, name=name):
            return name if part == which else usual

        weights = {of("weighted", "b"): 0.5, "c": 0.5}
        measured = ((of("sense", "weight"), 1.0),)
        look = RecordedLook((of("label", "a"), None), (0.5, None), (None, weights), measured)
        slots, action = (of("slot", "front"), "top"), of("action", "go")
        trial = RecordedTrial(of("trial", "t"), (look, look), (action,), of("object", "cup"))
        recording = Recording(slots, (action,), tuple(used_labels([trial])), (trial,), senses=(of("sense", "weight"),))
        try:
            reader = CsvReader(write_csv(recording))
        except InvalidInputError as error:
            assert str(error).endswith(".jsonl")  # noqa: PT017
            refused.append(name)
            continue
        assert reader.columns.slots == slots
        assert reader.trials() == [trial]
        assert not reader.faults
    assert "x" not in refused
    if part in ("label", "action", "object", "trial"):
        assert refused == [" x", "x ", "x\ry", "x" * 1001]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("action,", "deed,"), "line 1: no column 'action' in trial, step, deed"),
        (("label:confidence", "lable:confidence"), "line 1: column 'lable:confidence'; expected SLOT:confidence"),
        (("label:confidence", "label"), "line 1: column 'label' is repeated"),
        (("trial", ",trial"), "line 1: column ''; expected a name"),
        (("label:confidence", "side="), "line 1: column 'side='; expected a name"),
        (("label:confidence", "=logo"), "line 1: column '=logo'; expected a name"),
        (("label:confidence", "side= a,side=a"), "line 1: column 'side=a' is repeated"),
        (("label:confidence", "side,confidence"), "'confidence', and several slots; expected label:conf.*, side:conf"),
        (("0.5", "0_5"), "line 3, column 'label:confidence': '0_5'; expected a number from 0 to 1"),
        (("a,2,,,,cup", "a,2,,,,cup,more"), "line 4: 7 columns; expected 6"),
        (("a,1,", "a,3,"), "line 3, column 'step': 3; expected 1, one more than before"),
        (("a,1,", "a,0,"), "line 3, column 'step': 0; expected 1"),
        (("a,1,", "a,one,"), "line 3, column 'step': 'one'; expected a whole number"),
        (("b,0,tip,base,0.25,box\nb,1", "a,2,,,,cup\na,1"), "line 4, column 'action': empty"),
        (("0.5", "1.5"), r"line 3, column 'label:confidence': '1.5'; expected a number from 0 to 1"),
        (("0.5", "nan"), "line 3, column 'label:confidence': 'nan'; expected a number from 0 to 1"),
        (("0.5", "sure"), "line 3, column 'label:confidence': 'sure'; expected a number"),
        (("a,1,tip", "a,1,"), "line 3, column 'action': empty; expected what was done before the next look"),
        (("0.25,box", "0.25,bag"), r"line 6, column 'object': \['bag', 'box'\] in a trial; expected one"),
        (("a,1,tip,text", "a,1,tip,text,more"), "line 3: 7 columns; expected 6"),
        (("a,0,rotate", ",0,rotate"), "line 2, column 'trial': empty; expected the name of a trial"),
        (("logo", "x" * 1001), "line 2, column 'label': 1001 characters; expected at most 1000"),
        (('a,0,rotate,logo', 'a,0,rotate,"logo'), "expected CSV"),
    ],
)  # fmt: skip
def test_a_fault_is_one_line_that_says_where_and_what_was_expected(written, change, message):
    with pytest.raises(InvalidInputError, match=message):
        read_recording(written(PLAIN.replace(*change, 1)))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: empty; expected the names of the columns"),
        ("trial,step,action,label\n", "line 2: no rows; expected at least one look"),
        ("trial,step,action\n0,0,\n", "line 1: no slot in trial, step, action"),
        (b"trial,step,action,label\n0,0,,\xff\n", "line 2: byte 0xff, not UTF-8; expected a UTF-8 text file"),
        ("trial,step,action,label\n0,0,\n", "line 2: 3 columns; expected 4"),
        ('\n\n{"format": "other"}', "line 3: format: 'other'"),
        ('{"format": "atg-fg/recording", "version": 1, "slots": []}', "slots: .*; expected at least one"),
        ('{"format": "atg-fg/recording", "version": 1, "slots": ["a", "a"]}', "slots: .*all different"),
        ('{"format": "atg-fg/recording", "version": 1, "slots": ["a"], "labels": ["b", "b"]}', "labels: .*different"),
        ('{"format": "atg-fg/recording", "version": 1, "slots": ["a"], "actions": ["b", "b"]}', "actions: .*different"),
        ('{"format": "atg-fg/recording", "version": 1, "slots": ["a"], "senses": ["b", "b"]}', "senses: .*different"),
        ('{"format": "atg-fg/recording", "version": 1, "slots": ["a"], "senses": ["b", 3]}', "senses.*: 3; expected"),
        ("{", "line 1: not valid JSON"),
        ('{"format": "other"}', "format: 'other'; expected 'atg-fg/recording'"),
        ('{"format": "atg-fg/recording", "version": 1, "slots": ["a"]}', "line 1: no trials after it"),
    ],
)
def test_what_is_no_recording_is_refused(written, text, message):
    with pytest.raises(InvalidInputError, match=message):
        read_recording(written(text))


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ({"trial": 0, "actions": [], "looks": []}, "0 looks, 0 actions; expected one look more"),
        ({"trial": 0, "actions": ["go"], "looks": [["x"]]}, "1 looks, 1 actions"),
        ({"trial": 0, "actions": [], "looks": [["x", "y"]]}, "look 0: .*expected an entry for each of label"),
        ({"trial": 0, "actions": [], "looks": [[3]]}, "look 0, slot 'label': 3; expected a text"),
        ({"trial": 0, "actions": [], "looks": [[{"x": -1}]]}, "look 0, slot 'label': x: -1; expected"),
        ({"trial": 0, "actions": [], "looks": [[{"x": 0}]]}, "expected a likelihood above 0"),
        ({"trial": 0, "actions": [], "looks": [[{"": 1}]]}, "look 0, slot 'label': ''; expected a text"),
        ({"trial": 0, "actions": [], "looks": [[{"\ud800": 1}]]}, "expected a text of whole characters"),
        ({"trial": 0, "actions": [], "looks": [["x"]], "confidences": [[2]]}, "look 0: confidences: 2; expected"),
        ({"trial": 0, "actions": [], "looks": [["x"]], "more": 1}, "unknown key 'more'"),
        ({"trial": 0, "actions": [], "looks": [["x"]], "measured": []}, "measured: 0 entries; expected 1"),
        (
            {"trial": 0, "actions": [], "looks": [["x"]], "measured": [0.5]},
            "look 0: measured: 0.5; expected readings by",
        ),
        ({"trial": 0, "actions": [], "looks": [["x"]], "measured": [{"w": "1"}]}, "look 0: measured: w: '1'; expected"),
        (
            {"trial": 0, "actions": [], "looks": [["x"]], "measured": [{"w": 1e99}]},
            "look 0: measured: w: 1e.99; expected",
        ),
    ],
)
def test_a_faulty_line_is_named(written, line, message):
    header = {"format": "atg-fg/recording", "version": 1, "slots": ["label"]}
    with pytest.raises(InvalidInputError, match=f"line 2.*{message}"):
        read_recording(written(f"{json.dumps(header)}\n{json.dumps(line)}\n", "looks.jsonl"))
    with pytest.raises(InvalidInputError, match=f"line 4.*{message}"):
        read_recording(written(f"{json.dumps(header)}\n\n\n{json.dumps(line)}\n", "looks.jsonl"))


def test_lists_without_names_say_nothing(written):
    header = {"format": "atg-fg/recording", "version": 1, "slots": ["label"], "actions": [], "labels": []}
    trial = {"trial": 0, "actions": [], "looks": [[None]]}
    recording = read_recording(written(f"{json.dumps(header)}\n{json.dumps(trial)}\n", "looks.jsonl"))
    assert (recording.actions, recording.labels) == (("wait",), ("nothing",))


def test_a_closed_alphabet_closes_likelihoods_too(written):
    text = "trial,step,action,side=a,side=b\nt,0,go,1,0\nt,1,,0,1\n"
    with pytest.raises(InvalidInputError, match="line 1, column 'side=b': 'b'; expected one of: a"):
        read_recording(written(text), RecordingSpec(labels=("a",)))


@pytest.mark.parametrize("scale", [5e-324, 1e-300, 1e-20, 1e20, 1e308])
def test_likelihoods_of_any_scale_are_the_same_evidence(written, scale):
    """A detector of many pixels gives tiny ones; only their ratios count."""
    text = "trial,step,action,front=a,front=b,top=a,top=b\nt,0,,{0!r},{0!r},{0!r},{1!r}\n"
    looks = []
    for at in (1.0, scale):
        recording = read_recording(written(text.format(at, at / 2)))
        looks.append(recording.trials[0].looks[0].evidence(recording.assumptions(2)).likelihood)
    expected = [1.0, 0.5, 1.0, 0.5] if scale > 5e-324 else [1.0, 0.0, 1.0, 0.0]
    assert looks[0] == pytest.approx([1.0, 0.5, 1.0, 0.5])
    assert looks[1] / looks[1].max() == pytest.approx(expected)


def test_likelihoods_of_nothing_at_all_are_refused(written):
    text = "trial,step,action,side=a,side=b\na,0,tip,0.5,0.5\na,1,,0,0\n"
    with pytest.raises(InvalidInputError, match="line 3, column 'side': all likelihoods are 0; expected one above 0"):
        read_recording(written(text))
    assert read_recording(written(text.replace("0,0\n", ",\n"))).trials[0].looks[1].labels == (None,)


@pytest.mark.parametrize("change", [lambda data: data[:-9], lambda data: data[:20] + b"xx" + data[22:]])
def test_a_gzipped_table_that_is_damaged_is_refused(written, change):
    with pytest.raises(InvalidInputError, match=r"looks\.csv: cannot be read: .*; expected a gzipped text file"):
        read_recording(written(change(gzip.compress(PLAIN.encode()))))


@pytest.mark.parametrize("rows", ['"trial"x,step', 'trial,step,action,seen\n"t"x,0,,cup', "x" * 200_000])
def test_what_is_no_csv_is_refused_with_its_line_be_it_the_header_or_a_row(written, rows):
    with pytest.raises(InvalidInputError, match=rf"looks\.csv: line {rows.count(chr(10)) + 1}: .*; expected CSV"):
        read_recording(written(rows))
