"""Couplings between two oscillators, one file each.

A coupling is a module with SUMMARY, SOURCE, PARAMETERS (its strength is always called ``sigma``) and at least one of
``potential(q_i, q_j, weight, sigma, …)``, the energy stored between two coordinates, and
``dissipation(v_i, v_j, weight, sigma, …)``, a Rayleigh function whose negative velocity gradient is the force.
Where exchanging i and j changes the energy, links have a direction and the weight 1 (`synchain.models.interactions.link`).

These join coordinates, all of them or those named as in "spring on x".  A coupling that is linear in any states of any
node needs no file: a text such as "x->x, 1/2 y->z" is one (`synchain.models.interactions.coupling`).
"""
