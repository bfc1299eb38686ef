"""From a Lagrangian and a graph to exact equations and exact spectra.

    Lagrangian, Field, friction_law          one node
    link_energy, Rates                       one link
    chain, from_edges, cartesian …           a graph;   topology.spectrum: its exact eigenvalues
    Scene                                    a network with its numbers, starts and records, which `run` takes

Names are loaded on first use, so that importing this package costs next to nothing; editors read them in
`__init__.pyi`.

Every file of the folder `topologies` is offered as a function of the number of nodes and of its options:
``circulant(10, offsets=(1, 3))`` is ``topology("circulant", 10, offsets=(1, 3))``.  Families with another name in
networkx have that one too: ``path(4) == chain(4)``, ``cycle(5) == ring(5)``.

Glossary
--------
node, link    An oscillator of a network; the influence of node j on node i, with an exact weight.
kind          Nodes of one kind have the same oscillator, friction law and contact, and equations.
topology      Nodes and weighted links; adjacency minus degree is the connectivity matrix G.
family        A rule that makes the topology of any number of nodes: chain, ring, star.
spectrum      The exact eigenvalues γ of G with their multiplicities; largest first, the first is 0.
coupling      The terms of a link: an energy, a matrix between states, or any rates of its target.
layer         The links of one coupling on one graph; a network may have several.
contact       The jump of friction at rest: smoothed ("atan", steepness κ), or "set-valued".
slip state    Of a node with set-valued contact: +1 or -1 while it slips, 0 while it sticks.
quotient      The network of classes of nodes that move alike, which has fewer equations.
observable    A value of the states, reduced over the nodes and then over the window of a cell.
record        Output of a run: "sync_error", "section" or "trajectory".
scene         Model, parameter values, start, records and axes: everything that a run needs.
cell          One point of the axes of a scene: one initial-value problem.
"""
