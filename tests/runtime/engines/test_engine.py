"""The seam of engines: any solver of rows takes the place of the compiled kernels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from synchain import Field, Scene
from synchain.codegen.driver.columns import Count, SpanColumn, SumColumn
from synchain.runtime.cells.buffers import Buffers
from synchain.runtime.cells.plan import CellRows
from synchain.runtime.cells.reduce import reduce_scene
from synchain.runtime.engines.engine import Engine
from synchain.runtime.support.execution import Execution
from synchain.runtime.support.status import Status
from synchain.runtime.sweeps.memory import Memory
from synchain.runtime.sweeps.prepare import prepare

SCENE = Scene(
    Field({"x": "-a*x"}, parameters={"a": 1.0}),
    parameters={"a": 1.0},
    initial={"x": 2.0},
    axes={"a": [0.5, 1.0, 2.0]},
    transient=1.0,
    window=2.0,
)


@dataclass
class ClosedForm:
    """The solution x(t) = x(0) exp(-a t) of `SCENE`."""

    calls: int = 0

    def run(self, rows: CellRows) -> Buffers:
        buffers = Buffers.empty(len(rows), rows.start.shape[1], room=0, samples=0)
        end = rows.spans[:, SpanColumn.END]
        buffers.end[:] = rows.start * np.exp(-rows.numbers * end[:, None])
        buffers.sums[:, SumColumn.STOPPED_AT] = end
        buffers.counts[:, Count.STATUS] = Status.FINISHED
        self.calls += 1
        return buffers

    def cancel(self) -> None:
        """Nothing runs for long."""


def test_a_solver_of_rows_runs_a_sweep() -> None:
    prepared = prepare(reduce_scene(SCENE), Execution(1, None, False))
    reference = Memory.of(prepared, None)
    reference.run(prepared.execution.reporter(SCENE.cells))
    engine = ClosedForm()
    seam: Engine = engine
    prepared.job.engine = seam
    memory = Memory.of(prepared, None)
    memory.run(prepared.execution.reporter(SCENE.cells))
    result = memory.result()
    assert result.success
    assert engine.calls > 0
    expected = 2.0 * np.exp(-3.0 * np.array([0.5, 1.0, 2.0]))
    np.testing.assert_allclose(result.end.values.ravel(), expected, rtol=1e-15)
    np.testing.assert_allclose(reference.result().end.values.ravel(), expected, rtol=1e-7)
