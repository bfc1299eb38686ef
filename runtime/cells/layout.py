"""Divide a sweep into numbered blocks: cells that are run, stored and resumed together."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from synchain.models.scenes.scene import Scene

REFILLS = 16  # largest number of cells of a block per lane: a choice, so that few lanes are idle at the end of a block
SHARE = 8  # a block is at most 1/SHARE of the work of one worker, so that all workers are busy to the end: a choice
# Largest product of oscillators and periods of a block with more than one cell per lane: about a minute of work.
LONGEST = 1e7


@dataclass(frozen=True, slots=True)
class Layout:
    """Blocks of `size` cells, in C order over the axes."""

    # In a continued sweep, a block is one column of up to `size` rows: cells of one value of the last axis. Each block
    # depends on the block of the value before. `columns`: number of values of the last axis; 0 if the sweep is not
    # continued. `falling`: True if the values are run in falling order.

    cells: int
    size: int
    columns: int = 0
    falling: bool = False

    @classmethod
    def of(cls, scene: Scene, size: int) -> Layout:
        if not scene.continued:
            return cls(scene.cells, size)
        return cls(scene.cells, size, scene.shape[-1], scene.continuation == "down")

    @property
    def blocks(self) -> int:
        steps = max(self.columns, 1)
        return math.ceil(self.cells / steps / self.size) * steps

    def part(self, part: tuple[int, int] | None) -> np.ndarray:
        """Return whether each block (blocks,) belongs to part (k, N) of the sweep; all blocks belong to part None."""
        # The blocks are dealt to the parts in turn, so that all parts share a costly region of a map. The columns of a
        # continued sweep depend on one another, and stay in one part.
        chains = np.arange(self.blocks) // max(self.columns, 1)
        if part is None:
            return np.ones(self.blocks, dtype=bool)
        k, parts = part
        return np.asarray(chains % parts == k - 1)  # a part may be empty

    @property
    def lengths(self) -> np.ndarray:
        steps = max(self.columns, 1)
        first = np.arange(self.blocks) // steps * self.size  # row of a continued sweep, else cell
        return np.minimum(self.size, self.cells // steps - first)

    def rows(self, block: int) -> np.ndarray:
        if not self.columns:
            return np.arange(block * self.size, min((block + 1) * self.size, self.cells))
        group, step = divmod(block, self.columns)
        column = self.columns - 1 - step if self.falling else step
        last = min((group + 1) * self.size, self.cells // self.columns)
        return np.arange(group * self.size, last) * self.columns + column

    def after(self, block: int) -> int | None:
        """Return the block that depends on this one, or None."""
        return block + 1 if self.columns and (block + 1) % self.columns else None

    def before(self, block: int) -> int | None:
        """Return the block on which this one depends, or None."""
        return block - 1 if self.columns and block % self.columns else None


def block_size(scene: Scene, width: int, workers: int, cells: int | None = None) -> int:
    """Return the number of cells of a block, a multiple of the number of lanes."""
    # A block keeps all lanes busy, but is small enough to be lost when a run is interrupted.
    if cells is None:
        cells = scene.cells // (scene.shape[-1] if scene.continued else 1)
    lengths = scene.transient + scene.window
    work = scene.n * max(lengths if scene.time_unit == "period" else lengths / (2.0 * math.pi), 1.0)
    most = min(REFILLS * width, int(LONGEST / work) // width * width)
    return max(width, min(most, math.ceil(cells / (SHARE * workers) / width) * width))
