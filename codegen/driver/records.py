"""The records that functions of kernels pass to each other.

Numba passes a tuple as its parts, one after the other, and LLVM keeps the parts in registers: a record costs nothing.
Generated modules import these classes.
"""

from __future__ import annotations

from typing import Any, NamedTuple


class Step(NamedTuple):
    """A step of all lanes, and the states inside it: `driver/dense.py` evaluates them."""

    t: Any  # lanes; counted from the beginning of the period, or from 0 where events and values are sought
    h: Any
    y: Any  # address of the state at its beginning, followed by the parameters
    y_new: Any  # address of the state at its end
    dense: Any  # address of the coefficients of the dense output


class Rows(NamedTuple):
    """The input of cells: arrays with one row for each, and the array that controls the integration."""

    start: Any  # (cells, dimension)
    values: Any  # (cells, parameters)
    spans: Any  # (cells, 8), columns `SpanColumn`
    control: Any  # columns `Control`


class Results(NamedTuple):
    """The output of cells of a sweep."""

    end: Any  # (cells, dimension)
    sums: Any  # (cells, 4), columns `SumColumn`, or more if values are observed
    counts: Any  # (cells, 5 or more), columns `Count`
    points: Any  # (cells, room, dimension + 1), or (cells, room, 2 + kept) of sections on functions
    samples: Any  # (cells, samples, dimension)
    paused: Any  # (cells, any): lanes of cells that pause or whose steps underflow


class EventWorkspace(NamedTuple):
    """Contacts or rows: the functions of the scene that decide on them, their arguments and their output."""

    middle: Any  # address of a state inside a step
    out: Any  # address of the output of `pushes`
    clock: Any
    control: Any  # address
    network: Any  # arrays of links and their weights; () if the step is written out
    dims: Any
    functions: Any  # `pushes`; of rows `strike` too
    impacts: (
        Any  # address: of each row the largest speed at impacts since its stop closed, then the largest acceleration
    )


class Zeros(NamedTuple):
    """Section functions in a step: `section` writes their values, one row for a point, to `found`."""

    step: Step
    found: Any
    rule: Any  # rule of a panel
    dims: Any
    section: Any


class Tallied(NamedTuple):
    """Observed values in a step: `values` writes them, one row for a point, to `seen`."""

    step: Step
    seen: Any
    rule: Any  # rule of a panel
    dims: Any
    values: Any


class Orbit(NamedTuple):
    """Workspace of an orbit: all are addresses but `friction`."""

    clock: Any
    y: Any
    y_new: Any
    dense: Any
    shared: Any  # Jacobians of a step, or their series, for the modes
    before: Any  # the state before an event
    changed: Any  # 1 for each contact or row that changes at the event
    control: Any
    friction: EventWorkspace


class Modes(NamedTuple):
    """Deviations along an orbit; a register holds a component of LANES of them.

    They begin as `vectors`, a deviation for each column of a propagator of each node. While bodies that stick are between
    two landings there is one deviation for each node, in the first `node_registers`.
    """

    vectors: Any  # (cells, parts, modes)
    parts: Any  # components of a deviation
    tolerance: Any
    framed: Any  # True if deviations are made orthogonal after each block
    registers: Any
    node_registers: Any
    powers: Any  # addresses from here: powers of two of the deviations, strengths of both kinds
    strengths: Any
    node_strengths: Any


class Carried(NamedTuple):
    """What changes from step to step of the modes."""

    old: Any  # addresses of the deviations at the beginning and at the end of a step
    new: Any
    fresh: Any  # True if the deviations must begin from `Modes.vectors`
    in_interval: Any  # True between two landings, with one deviation for each node
    landed: Any  # True if a body has begun to stick in the last step
    cut_at: Any  # time of the last cut, from the beginning of the block


class Propagators(NamedTuple):
    """Propagators of nodes: entry (r, c) of node k is table[(parts * c + r) * stride + k] * 2**exponents[k]."""

    table: Any
    exponents: Any
    stride: Any
    places: Any  # address (nodes * columns): the deviations that are the columns of a propagator
    nodes: Any
    columns: Any
    parts: Any


class Panels(NamedTuple):
    """Panels of strengths and their weights, see `driver/propagators.py`."""

    panels: Any
    weights: Any


class Targets(NamedTuple):
    """Deviations of all strengths, in registers; all but `groups` are addresses."""

    groups: Any  # registers
    moved: Any
    lifts: Any  # powers of two of `moved`
    found: Any  # scratch for the propagators of TILE registers
    kept: Any  # component that the last landing has left, and its powers of two
    kept_powers: Any


class StickIntervals(NamedTuple):
    """Interpolation from the nodes that are integrated to the nodes of panels, of bodies that stick."""

    panels: Any
    weights: Any
    where: Any  # (nodes of panels): their places in registers
    share: Any  # addresses from here: products of the factors of intervals, and their powers of two
    share_powers: Any
    fine: Any  # the same in the order of the nodes of panels
    heights: Any
    work: Any
