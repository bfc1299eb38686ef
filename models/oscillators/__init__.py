"""Oscillators, one file each.

Every file has SUMMARY, SOURCE, PARAMETERS (name -> Parameter, of the non-dimensional equations) and FRICTION (True
if it takes a friction law).  The model itself is one of three kinds:

* a physical Lagrangian: ``kinetic``, ``potential`` and, if there are non-conservative forces, ``force`` in physical
  quantities; PHYSICAL, which names the physical quantity behind each parameter; UNITS of the quantities that
  fix the scales; and ``scales``, the units of mass, length and time (keys kg, m, s) made of these.
  The non-dimensional equations are derived from it;
* a non-dimensional Lagrangian: the same three functions in the parameters themselves, without ``scales``;
* a first-order vector field: STATE, the names of the variables, and ``field``, which returns their rates.

A function receives what its signature names: the coordinate ``x``, the velocity ``v``, the time ``t``, parameters,
and ``friction``, the friction coefficient as a function of the sliding velocity.  COORDINATES (name -> (name of its
velocity, unit)) is ``{"x": ("v", "m")}`` unless the file says otherwise; with several coordinates ``force`` returns
one entry for each.  Damping may be written as a Rayleigh function ``dissipation`` of the velocities, half the
power lost; its negative derivatives are added to the forces.  Where the mass matrix is full or depends on the state,
``particles`` returns (mass, across, upward) of each mass as functions of the coordinates; the kinetic energy is proved
from it.

INITIAL (state -> number, states left out are 0) may say around which state oscillators start unless told otherwise.
"""
