"""The sizes of the arrays of a scene, which a driver is told when it runs."""

from __future__ import annotations

from typing import NamedTuple


class Dimensions(NamedTuple):
    """What a driver of a sweep must know of a scene and of its integrator."""

    dimension: int
    """State variables of the network; this and the next are all that functions of a scene are told."""
    dense_rows: int
    """Coefficients of the dense output for each state variable."""
    nodes: int
    components: int
    """States of a node that the synchronisation error compares; 0 if it is not recorded."""
    parameters: int
    workspace: int
    """Groups of scratch memory behind the dense output."""
    error_order: int
    repeats: int
    """1 if the right-hand side is periodic in time, so that a computation can repeat itself, else 0."""
    observed: int
    """Values that are observed."""
    gaps: int
    """What passes zero where an observed value jumps or has a kink."""
    depths: int
    """How many e-folds a part of an observed value lies below or above the size one."""
    sections: int
    """Sections of which points are taken."""
    kept: int
    """Most values that a point of a section on a function keeps; -1 if points are whole states."""
    sampled: int
    """0 if no trajectory is recorded, 1 for equally spaced samples, 2 for samples at the times in `control`."""
    stops: int
    """1 if a function of the state ends a cell, else 0."""
    rows: int
    """Contacts, or rows of all nodes."""
    felt: int
    """The largest number of rows of a node."""
    contacts: int
    """Groups of memory for the output of `pushes`, and for what the driver stores behind it."""
    events: int
    """1 if events are recorded, else 0."""


class ModeDimensions(NamedTuple):
    """What a driver that carries deviations along an orbit must know."""

    dimension: int
    dense_rows: int
    nodes: int
    parameters: int
    workspace: int
    error_order: int
    repeats: int
    strengths: int
    """Numbers that differ from mode to mode."""
    shared: int
    """Length of the array in which a step of the orbit leaves what the modes need."""
    rows: int
    """Contacts, or rows of all nodes."""
    felt: int
    """The largest number of rows of a node."""
    contacts: int
    """Groups of memory for the output of `pushes`, and for what the driver stores behind it."""
