"""What ``import atg_fg`` gives, and what it leaves alone until it is asked for."""

import subprocess
import sys

import pytest

import atg_fg

LOADED = "import sys; print(*(name for name in sys.modules if name.count('.') < 3))"


def modules_after(code):
    """Return the modules that a new process has loaded when it has run ``code``."""
    process = subprocess.run([sys.executable, "-c", f"{code}\n{LOADED}"], capture_output=True, text=True, check=True)
    return set(process.stdout.splitlines()[-1].split())


@pytest.mark.parametrize("name", atg_fg.__all__)
def test_every_public_name_is_there(name):
    assert getattr(atg_fg, name) is not None
    assert name in dir(atg_fg)


def test_a_name_that_is_none_is_refused():
    with pytest.raises(AttributeError, match="RobotMemories"):
        atg_fg.RobotMemories  # noqa: B018


def test_the_import_loads_no_more_than_the_environments_names():
    loaded = modules_after("import atg_fg")
    assert {name for name in loaded if name.startswith("atg_fg.")} == {
        "atg_fg.core", "atg_fg.core.version", "atg_fg.experiments", "atg_fg.worlds",
    }  # fmt: skip
    assert not loaded & {"gtsam", "networkx", "typer", "rich", "matplotlib", "scipy", "sqlite3", "jinja2"}


def test_a_name_loads_what_it_needs_alone():
    loaded = modules_after("from atg_fg import RobotMemory")
    assert "atg_fg.core.memory" in loaded
    assert not loaded & {"gtsam", "atg_fg.engines", "atg_fg.policies", "atg_fg.storage", "atg_fg.display"}


def test_environments_are_registered_by_the_import():
    code = "import gymnasium, atg_fg; print(gymnasium.make('atg_fg/{}-v0').unwrapped.spec.id)"
    for name in ("ARcube", "RingLock", "Recognition"):
        process = subprocess.run([sys.executable, "-c", code.format(name)], capture_output=True, text=True, check=True)
        assert process.stdout == f"atg_fg/{name}-v0\n"


def test_an_engine_is_loaded_when_it_is_asked_for():
    code = (
        "from atg_fg import RobotMemory, arcube_assumptions, begin_trial, preset\n"
        "begin_trial('bayes-filter', RobotMemory(arcube_assumptions(2)), preset('paper'))"
    )
    loaded = modules_after(code)
    assert "atg_fg.engines.bayes_filter" in loaded
    assert not loaded & {"gtsam", "atg_fg.engines.particle_filter"}
    assert "gtsam" in modules_after(code.replace("bayes-filter", "gtsam"))
