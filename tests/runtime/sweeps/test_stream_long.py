"""A hundred kills at random moments: nothing that was done is lost, and the file is that of a run without kills."""

from __future__ import annotations

import pytest
from streams import MAP, UP, kill_again_and_again

pytestmark = pytest.mark.long


@pytest.mark.parametrize(("scene", "times"), [(MAP, 70), (UP, 30)], ids=["map", "continued"])
def test_a_hundred_kills(scene, times, tmp_path):
    resumed, _ = kill_again_and_again(scene, tmp_path, times, seed=2)
    assert resumed > times // 3
