"""Names that results have for something else: of what is swept and drawn, of observables and of sections."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from synchain import Field, Rates, Scene
from synchain.graphs import chain
from synchain.models.inputs.names import ATTRIBUTES, TAKEN


def decay(name: str, **keywords: object) -> Scene:
    return Scene(Field({"x": f"-{name}*x"}, parameters={name: 1}), "x->x", chain(2), record=(), **keywords)


@pytest.mark.parametrize("name", sorted(TAKEN))
def test_what_is_swept_or_drawn_has_a_name_of_its_own(name: str) -> None:
    assert decay(name).parameters[name] == 1.0
    message = f"found the name '{name}', which results have for something else; rename it"
    with pytest.raises(ValueError, match=f"axis {name}: {message}"):
        decay(name, axes={name: [1, 5]})
    with pytest.raises(ValueError, match=f"draw {name}: {message}"):
        decay(name, realisations=2, draws={name: [1, 5]})


@pytest.mark.parametrize("name", sorted(ATTRIBUTES))
def test_attributes_of_results_hide_variables_alone(name: str) -> None:
    assert decay(name, axes={name: [1, 5]}).shape == (2,)
    for table in ({"observe": {name: "mean(x_1)"}}, {"sections": {name: {"function": "x_1"}}}):
        with pytest.raises(ValueError, match=f"found the name '{name}', which results have for something else"):
            decay("rate_of_x", **table)


def test_draws_of_links_have_a_dimension_of_their_own() -> None:
    link = Rates({"x": "W*(k + k_link)*(x_j - x_i)"}, {"k": 1, "k_link": 1})
    with pytest.raises(ValueError, match="draw k: found the name 'k_link'"):
        Scene(
            Field({"x": "-x"}), link, chain(3), axes={"k_link": [1, 2]}, realisations=2, draws={"k": "normal(1, 0.1)"}
        )


@pytest.mark.parametrize(
    ("sections", "name"),
    [({"u": {"function": "x_1"}}, "u_time"), ({"s": {"function": "x_1"}, "s_time": {"function": "x_2"}}, "s_time")],
)
def test_sections_make_names_too(sections: Mapping[str, object], name: str) -> None:
    with pytest.raises(ValueError, match=f"sections: found the name '{name}', which results have for something else"):
        decay("u_time", sections=sections)
