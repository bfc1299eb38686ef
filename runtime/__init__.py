"""From a scene to results: runs, exponents, thresholds, equilibria, periodic orbits and the command line.

    run, stream                                        trajectories and records of all cells of a scene
    exponents, msf, plane, cluster_exponents,
    lyapunov_spectrum                                  stability of synchronous, clustered and other motion
    thresholds, universal_probe, basin                 strengths and starts that synchronise
    equilibrium, periodic_orbit, follow, skeleton      states at rest, orbits, their branches and bifurcations

Names are loaded on first use, so that the command line starts fast.

Glossary
--------
cell          One run of a sweep, with one set of parameters and initial states, and one status.
row           The input of a kernel for one cell: parameters, initial states, times.
span          The times of a cell: ends of its window, period of the drive, and the error at which it may end early.
block         A number of cells that are run, stored and resumed together.
transient     The time before the recording begins.
window        In a run, the time of the recording. For σ, a range in which every transversal mode decays.
strength      α = -σγ, real or complex, for an eigenvalue γ of the network and the coupling σ.
mode          A deviation from synchrony along an eigenvector of the network.
interval      A range of strengths α with negative exponent.
verdict       Statement whether and where a network synchronises.
probe         Two or three oscillators whose simulation represents one mode of any network.
certificate   Exponent and verdict of the synchronous state for each cell of a sweep.
"""
