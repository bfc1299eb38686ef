"""ROS34PW2: Rosenbrock-W method of order 3(2) with 4 stages, whose order does not depend on the Jacobian.

The matrix of the linear equations omits the derivatives between different oscillators, so that each oscillator is
solved separately.  The dense output is the chord between the ends of the step.
"""

KIND = "rosenbrock"
ORDER = 3
ERROR_ORDER = 2
DENSE_ORDER = 1
SOURCE = "Rang & Angermann, BIT Numerical Mathematics 45, 761 (2005)"
INEXACT = True
GAMMA = 0.435866521508459

A: tuple[tuple[float, ...], ...] = (
    (),
    (2.0,),
    (1.4192173174557647, -0.2592322116729697),
    (4.18476048231916, -0.28519201735549593, 2.294280360279042),
)
BIG_C: tuple[tuple[float, ...], ...] = (
    (),
    (-4.588560720558084,),
    (-4.18476048231916, 0.28519201735549593),
    (-6.368179200128359, -6.795620944466837, 2.8700986043310563),
)
C = (0.0, 0.871733043016918, 0.7315799577888524, 1.0)
TIME_WEIGHTS = (0.435866521508459, -0.435866521508459, -0.4133333762338865, 0.0)
B = (4.1847604823191595, -0.28519201735549565, 2.2942803602790414, 1.0)
E = ((0.2777499476479681, -1.4032398951759992, 1.7726301276675507, 0.5),)
DENSE: tuple[tuple[float, ...], ...] = ((0.0, 0.0, 0.0, 0.0),)
