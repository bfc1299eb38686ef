"""Friction laws, one file each, and the regularisation that they share.

A law is a module with SUMMARY, SOURCE (journal, volume, page), PARAMETERS (name -> Parameter, unit of the physical
quantity), ODD (True if f(-w) = -f(w); tested) and ``force(w, <names of its parameters>)``.  `force` returns the
friction coefficient, the friction force divided by the normal load (unit 1), on the sliding body for the velocity
w of the ground relative to the body (unit m/s), so that w f(w) >= 0: the body is dragged along.  Write the jump
with ``sympy.sign`` and ``sympy.Abs`` of w and no floating-point numbers.  A law may have ``static(<parameters>)``, the
static friction coefficient if it exceeds f(0+); only the contact "set-valued" knows it.  ORDER lists pairs of parameters
of which the first must not exceed the second under that contact: below f(0+) a static coefficient makes a body chatter.
"""
