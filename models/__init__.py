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
kind          A set of nodes with the same oscillator, friction law, contact and equations.
topology      A graph: nodes and weighted links. Adjacency minus degree is the connectivity matrix G.
family        A rule that defines a graph for any number of nodes, such as chain, ring or star.
spectrum      The exact eigenvalues γ of G with their multiplicities, sorted from 0 downwards.
coupling      The terms of a link: an energy, a matrix between states, or any rates of the target.
layer         The links of one coupling on one graph; a network may have several layers.
contact       The treatment of the jump of friction at rest: smoothed ("atan", steepness κ), or "set-valued".
slip state    State of a node with set-valued contact: +1 or -1 while it slips, 0 while it sticks.
quotient      A smaller network with one node for each class of equal nodes.
observable    An average or extreme value of an expression of the states over the window.
record        Output of a run: "sync_error", "section", "trajectory" or "events".
scene         All settings of a run: model, parameters, initial states, records and axes.
"""
