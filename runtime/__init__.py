"""From a scene to results: runs, exponents, thresholds, equilibria, periodic orbits and the command line.

    run, stream                                        trajectories and records of all cells of a scene
    exponents, msf, plane, cluster_exponents,
    lyapunov_spectrum                                  stability of synchronous, clustered and other motion
    thresholds, universal_probe, basin                 strengths and starts that synchronise
    equilibrium, periodic_orbit, follow, skeleton      states at rest, orbits, their branches and bifurcations

Names are loaded on first use, so that the command line starts fast.

Glossary
--------
cell          One point of the axes of a scene: one initial-value problem with one status.
row           The input of a kernel for one cell: parameter values, initial states, span.
span          Of one cell: the ends of its window, its period, and the error of a synchronous cell.
block         Cells that are run, stored and resumed as one piece.
lane          One of the numbers in a SIMD register; each lane integrates another cell.
transient     Time that is integrated before anything is recorded; the window follows it.
strength      α = -σγ, real or complex, of an eigenvalue γ of the network and the coupling σ.
mode          A deviation from synchrony along an eigenvector of the network.
interval      A range of strengths with negative exponent.
window        Of a run: the time that is recorded. Of σ: a range in which every mode dies out.
verdict       Whether and where a network synchronises, decided from the intervals and the spectrum.
probe         Two or three oscillators whose simulation stands for a mode of any network.
certificate   Exponents and verdict of the synchronous state of each cell of a sweep.
"""
