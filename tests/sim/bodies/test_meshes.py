import sys

import pybullet_data
import pytest

from atg_fg.core.errors import MissingDependencyError
from atg_fg.worlds.registry import make_world_with


@pytest.mark.parametrize("lacks", ["package", "folder"])
def test_a_set_up_without_the_meshes_is_told_how_to_get_them(lacks, monkeypatch, tmp_path):
    if lacks == "package":
        monkeypatch.setitem(sys.modules, "pybullet_data", None)
    else:
        monkeypatch.setattr(pybullet_data, "getDataPath", lambda: str(tmp_path))
    with pytest.raises(
        MissingDependencyError, match=r"world 'meshes': .*not installed; expected .*pip install"
    ) as error:
        make_world_with("meshes", 3, 0)
    assert "\n" not in str(error.value)
