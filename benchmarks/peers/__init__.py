"""Other programs that solve the benchmark's problems.

`PEERS` is the table of them: a new peer is a row, and a function that prepares it in a file of this folder.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial

from . import boost_cash_karp, diffrax_kvaerno5, heyoka_solvers, jitcode_solvers, numbalsoda_solvers, scipy_solvers
from . import sundials_solvers as sundials
from .peer import Peer, ladder

__all__ = ["PEERS", "Peer", "present", "skipped"]

HEYOKA_TOLERANCES = tuple((10.0 * tol, tol) for tol in (1e-6, 1e-8, 1e-10, 1e-12, 1e-14))
PAPER_TOLERANCES = ((1e-6, 1e-8), (1e-9, 1e-12), (1e-12, 1e-15))  # the last pair is that of the source paper
NUMBALSODA = "numbalsoda (its build needs gfortran)"
JITCODE = "jitcode and a C compiler"
LANES = 8  # trajectories that heyoka integrates together

PEERS = {
    "boost_cash_karp": Peer(
        "Cash-Karp, C++ Boost Odeint",
        "g++ and the headers of Boost (libboost-dev)",
        boost_cash_karp.prepare,
        PAPER_TOLERANCES,
        programs=("g++",),
        fault=boost_cash_karp.fault,
    ),
    "diffrax_kvaerno5": Peer(
        "diffrax Kvaerno5", "diffrax", diffrax_kvaerno5.prepare, ladder(4, 10, 2), modules=("jax", "diffrax")
    ),
    "heyoka_batch": Peer(
        "heyoka Taylor batch",
        "heyoka",
        partial(heyoka_solvers.prepare, lanes=LANES),
        HEYOKA_TOLERANCES,
        modules=("heyoka",),
        cells=LANES,
    ),
    "heyoka_taylor": Peer(
        "heyoka Taylor", "heyoka", partial(heyoka_solvers.prepare, lanes=1), HEYOKA_TOLERANCES, modules=("heyoka",)
    ),
    "jitcode_dop853": Peer(
        "JiTCODE DOP853",
        JITCODE,
        partial(jitcode_solvers.prepare, method="dop853", jacobian=False),
        ladder(5, 12),
        modules=("jitcode", "symengine"),
    ),
    "jitcode_lsoda": Peer(
        "JiTCODE LSODA",
        JITCODE,
        partial(jitcode_solvers.prepare, method="lsoda", jacobian=True),
        ladder(5, 13),
        modules=("jitcode", "symengine"),
    ),
    "numbalsoda_dop853": Peer(
        "numbalsoda DOP853", NUMBALSODA, numbalsoda_solvers.dop853, ladder(5, 12), modules=("numbalsoda",)
    ),
    "numbalsoda_lsoda": Peer(
        "numbalsoda LSODA", NUMBALSODA, numbalsoda_solvers.lsoda, ladder(5, 13), modules=("numbalsoda",)
    ),
    "scipy_bdf": Peer("SciPy BDF", "scipy", partial(scipy_solvers.implicit, method="BDF"), ladder(4, 12, 2)),
    "scipy_lsoda": Peer("SciPy LSODA (odeint)", "scipy", scipy_solvers.lsoda, ladder(5, 13)),
    "scipy_radau": Peer("SciPy Radau", "scipy", partial(scipy_solvers.implicit, method="Radau"), ladder(4, 12, 2)),
    "sundae_adams": Peer(
        "CVODE Adams (scikit-SUNDAE)",
        "scikit-sundae",
        partial(sundials.prepare, method="Adams"),
        ladder(5, 12),
        modules=("sksundae.cvode",),
    ),
    "sundae_bdf": Peer(
        "CVODE BDF (scikit-SUNDAE)",
        "scikit-sundae",
        partial(sundials.prepare, method="BDF"),
        ladder(5, 13),
        modules=("sksundae.cvode",),
    ),
}


def present(names: Iterable[str] = PEERS) -> list[Peer]:
    """Return the peers of these names that can run here."""
    return [PEERS[name] for name in names if not PEERS[name].absence()]


def skipped(names: Iterable[str] = PEERS) -> list[str]:
    """Return a line for each of these peers that cannot run here, with the reason and what to install."""
    reasons = {PEERS[name].name: PEERS[name].absence() for name in names}
    return [f"skipped: {name} ({reason})" for name, reason in reasons.items() if reason]
