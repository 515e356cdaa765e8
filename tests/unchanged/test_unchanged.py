"""What the command line gave before the code was restructured, it gives today, byte for byte (``cases.py``)."""

import difflib

import pytest

from tests.unchanged.cases import CASES, Case
from tests.unchanged.running import expected, same, this_machine, transcript


@pytest.mark.parametrize(
    "case", [pytest.param(case, id=case.name, marks=[pytest.mark.slow] * case.slow) for case in CASES]
)
def test_the_output_is_the_one_written_down(case: Case) -> None:
    found, (written, machine) = transcript(case), expected(case)
    if not same(found, written, machine):
        changes = difflib.unified_diff(
            written.splitlines(), found.splitlines(), "written down", "now", n=1, lineterm=""
        )
        pytest.fail("\n".join(line[:300] for _, line in zip(range(40), changes, strict=False)))


@pytest.mark.parametrize("machine", [this_machine(), "another"])
def test_another_number_is_noticed_on_any_machine(machine: str) -> None:
    written = '{"success": 0.7200000000000001, "lost": 0}'
    assert same(written, written, machine)
    assert not same(written.replace("0.72", "0.73"), written, machine)
    assert not same(written.replace("lost", "gone"), written, machine)
    assert not same(written.replace(": 0}", ": 1}"), written, machine)
    assert same(written.replace("01,", "02,"), written, machine) == (machine == "another")
