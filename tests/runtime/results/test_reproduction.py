"""Published numbers beside computed ones."""

from __future__ import annotations

import numpy as np
import pytest

from synchain.results import Reproduction


def test_a_number_agrees_up_to_the_given_difference() -> None:
    claims = {"at the edge": (0.3, 0.1 + 0.2, 0.0), "inside": (1, 1.1, 0.1), "outside": (1, 1.11, 0.1)}
    table = Reproduction({**claims, "not found": (2, np.nan, 5)})
    assert table.agrees.tolist() == [True, True, False, False]
    assert not table.reproduced
    assert Reproduction({"inside": (1, 1.1, 0.1)}).reproduced
    assert table.data.found.sel(quantity="outside") == 1.11
    assert table.as_dict()["found"][-1] is None


@pytest.mark.parametrize(
    ("claims", "message"),
    [
        ({}, "claims: found none; expected at least one quantity"),
        ({"a": (1, 2)}, "a: found 2 numbers; expected published, found, difference"),
        ({"a": (np.nan, 2, 1)}, "a: published number: found nan; expected a finite number"),
        ({"a": (1, 2, -1)}, "a: difference: found -1.0; expected a number of at least 0"),
    ],
)
def test_claims_that_say_nothing_are_refused(claims: dict[str, tuple[float, ...]], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Reproduction(claims)  # type: ignore[arg-type]
