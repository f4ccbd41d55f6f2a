"""The example of docs/theory-loadcells.md runs and gives what it says."""

import re
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "theory-loadcells.md"


def test_two_constant_moments_give_the_force_and_arm_that_the_page_states():
    code = re.search(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)[1]
    stated = [float(number) for number in re.findall(r"# ([\d.]+) N, ([\d.]+) N, ([\d.]+) mm", code)[0]]
    names = {}
    exec(compile(code, str(PAGE), "exec"), names)
    found = names["found"]
    reached = found.force_N[-1], found.force_std_N[-1], found.arm_mm[-1]
    # 8 and 5 N m over 0.15 m are 20 N, 0.25 m below the lower cell at 0.26 m.
    assert reached == pytest.approx(stated, rel=0.01)
    assert reached[0] == pytest.approx(20.0)
    assert reached[2] == pytest.approx(10.0)
