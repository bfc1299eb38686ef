"""JaxCont: JAX differentiates the rates and compiles the continuation."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any


def rest() -> Mapping[str, Sequence[float]]:
    """Return folds and Hopf points of Jansen and Rit's column."""
    import jax
    import jax.numpy as jnp
    import jaxcont

    jax.config.update("jax_enable_x64", True)

    def rates(state: Any, p: Any, _: object) -> Any:
        def sigmoid(v: Any) -> Any:
            return 5 / (1 + jnp.exp(0.56 * (6 - v)))

        y0, u0, y1, u1, y2, u2 = state
        return jnp.array(
            [
                u0,
                325 * sigmoid(y1 - y2) - 200 * u0 - 10000 * y0,
                u1,
                325 * (p + 108 * sigmoid(135 * y0)) - 200 * u1 - 10000 * y1,
                u2,
                37125 * sigmoid(135 * y0 / 4) - 100 * u2 - 2500 * y2,
            ]
        )

    near_rest = jnp.array([0.00065, 0.0, -1.332, 0.0, 2.522, 0.0])
    settings = jaxcont.ContinuationPar(ds=0.1, ds_min=1e-6, ds_max=1.0, max_steps=4000, newton_tol=1e-9)
    problem = jaxcont.bif_problem(rates, near_rest, -60.0)
    events = [jaxcont.Fold(), jaxcont.Hopf()]
    found = jaxcont.continuation(problem, p_span=(-60.0, 400.0), settings=settings, events=events).events
    return {kind: [float(each.p) for each in found if each.kind == kind.lower()] for kind in ("fold", "Hopf")}


CASES: Mapping[str, Callable[[], Mapping[str, Sequence[float]]]] = {"Jansen-Rit, rest": rest}
