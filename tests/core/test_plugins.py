"""Code of a user's own by name, and what installed packages register."""

from importlib.metadata import EntryPoint

import numpy as np
import pytest

import atg_fg.engines
import atg_fg.policies
from atg_fg.core import plugins
from atg_fg.core.assumptions import arcube_assumptions
from atg_fg.core.errors import InvalidInputError, UnknownNameError
from atg_fg.core.memory import RobotMemory
from atg_fg.core.parameters import ModelParameters
from atg_fg.engines import ENGINES, begin_trial
from atg_fg.engines.bayes_filter import BayesFilter
from atg_fg.policies import RandomPolicy, make_policy


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("no_such_module:x", "thing 'no_such_module:x': cannot be imported: No module named"),
        ("json:nothing", "json has no 'nothing'; expected module:object"),
        (".:x", "no name of a module"),
        ("a b:x", "no name of a module"),
        ("json:", "json has no ''"),
        ("\0:x", "no name of a module"),
    ],
)
def test_what_is_not_there_is_one_line(name, message):
    with pytest.raises(InvalidInputError, match=message):
        plugins.imported("thing", name)


@pytest.mark.parametrize(
    ("module", "told"),
    [
        ("raise RuntimeError('no weights\\nin /models')", "RuntimeError: no weights in /models"),
        ("def f(:", "SyntaxError: "),
        ("import sys; sys.exit('bye')", "SystemExit: bye"),
        ("import nowhere_at_all", "No module named 'nowhere_at_all'"),
        ("assert False", "AssertionError; expected"),
    ],
)
def test_a_module_that_fails_when_it_is_imported_is_one_line(module, told, tmp_path, monkeypatch):
    name = f"failing_{abs(hash(module))}"
    (tmp_path / f"{name}.py").write_text(module)
    monkeypatch.syspath_prepend(str(tmp_path))
    entry = EntryPoint("mine", f"{name}:thing", "atg_fg.engines")
    for get in (lambda: plugins.imported("thing", f"{name}:thing"), lambda: plugins.loaded("thing", entry)):
        with pytest.raises(InvalidInputError, match=f"cannot be imported.*: {told}") as refused:
            get()
        assert "\n" not in str(refused.value)


def test_an_object_inside_of_another_is_found():
    assert plugins.imported("thing", "json:JSONDecoder.decode").__name__ == "decode"


@pytest.fixture
def installed(monkeypatch):
    groups = {
        "atg_fg.engines": {
            "mine": EntryPoint("mine", "atg_fg.engines.bayes_filter:BayesFilter", "atg_fg.engines"),
            "broken": EntryPoint("broken", "nowhere:Nothing", "atg_fg.engines"),
            "gtsam": EntryPoint("gtsam", "nowhere:Nothing", "atg_fg.engines"),
        },
        "atg_fg.policies": {"mine": EntryPoint("mine", "atg_fg.policies:RandomPolicy", "atg_fg.policies")},
    }
    for place in (plugins, atg_fg.engines, atg_fg.policies):
        monkeypatch.setattr(place, "registered", groups.__getitem__)


def test_engines_and_policies_of_other_packages_have_names(installed):
    assert ENGINES["mine"] is BayesFilter
    assert {"mine", "gtsam", "broken"} <= set(ENGINES)
    assert len(ENGINES) == len(list(ENGINES))
    assert isinstance(make_policy("mine"), RandomPolicy)
    memory = RobotMemory(arcube_assumptions())
    assert isinstance(begin_trial("mine", memory, ModelParameters()), BayesFilter)
    assert begin_trial("gtsam", memory, ModelParameters()).name == "gtsam"  # a name of this package's own stays
    with pytest.raises(InvalidInputError, match="engine 'broken': cannot be imported from nowhere:Nothing"):
        begin_trial("broken", memory, ModelParameters())
    with pytest.raises(UnknownNameError, match="mine"):
        make_policy("none")


def test_an_engine_may_be_a_class_or_its_place():
    memory = RobotMemory(arcube_assumptions())
    beliefs = [
        begin_trial(engine, memory, ModelParameters()).identity().objects
        for engine in ("bayes-filter", "atg_fg.engines.bayes_filter:BayesFilter", BayesFilter)
    ]
    assert all(np.array_equal(belief, beliefs[0]) for belief in beliefs)
