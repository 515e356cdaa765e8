"""Libraries that one would pick instead, on the same model; each optional, in the extra ``bench``.

A new peer is one new file with a subclass of ``Contestant`` and one line here.
"""

from __future__ import annotations

import importlib
import warnings
from typing import Final

from atg_fg.core.errors import MissingDependencyError
from benchmarks.contestants import Contestant
from benchmarks.dense_tables import DenseModel

#: Module and class of each peer, and the module that has to be installed.
PEERS: Final[dict[str, tuple[str, str, str]]] = {
    "JAX": ("jax_filter", "JaxFilter", "jax"),
    "pyAgrum": ("pyagrum_slices", "PyAgrumSlices", "pyagrum"),
    "pgmpy": ("pgmpy_slices", "PgmpySlices", "pgmpy"),
    "pymdp": ("pymdp_agent", "PymdpAgent", "pymdp"),
}
#: The preset that all peers are given: without learning in the trial their tables hold throughout.
PRESET: Final = "paper"


def make_peer(name: str, model: DenseModel) -> Contestant:
    """Return a peer with its tables made.

    Raises:
        MissingDependencyError: Its library is not installed.
    """
    module, class_name, library = PEERS[name]
    # They warn of their own insides while they are loaded and first used, and pyAgrum crashes where that is an error.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            importlib.import_module(library)
        except ImportError as error:
            raise MissingDependencyError(f"not installed: pip install 'atg-fg[bench]' brings {name}") from error
        peer: Contestant = getattr(importlib.import_module(f"benchmarks.peers.{module}"), class_name)(model)
        peer.begin()
        peer.decide()
    return peer
