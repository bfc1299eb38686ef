"""How many lanes a kernel has if nobody asks for a number."""

from __future__ import annotations

import pytest

from synchain import Scene
from synchain.codegen.integrators import integrator
from synchain.codegen.kernels.sweep_kernel import emit
from synchain.codegen.simd.lane_types import native_width
from synchain.graphs import chain

PAIR = Scene(topology=chain(2), parameters={"kappa": 10.0}).equations


@pytest.mark.parametrize(
    ("n", "method", "order", "registers"),
    [(1, "taylor", 8, 2), (2, "taylor", 8, 2), (2, "taylor", 20, 1), (4, "taylor", 8, 1), (1, "rodas5p", 0, 2), (2, "rodas5p", 0, 1)],
)  # fmt: skip
def test_small_steps_take_two_registers(n: int, method: str, order: int, registers: int) -> None:
    """The longest step of a pair does not fit into the decoded instructions of a processor twice."""
    equations = PAIR if n == 2 else Scene(topology=chain(n), parameters={"kappa": 10.0}).equations
    chosen = integrator(method, order) if order else integrator(method)
    assert emit(equations, chosen).driver.width == native_width(registers)
    assert emit(equations, chosen, width=4).driver.width == 4
