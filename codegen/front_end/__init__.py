"""How functions of kernels are compiled: their syntax tree becomes LLVM; all of Numba's pipeline that this needs.

Knows no lanes: operations come from what `simd` tells Numba.
"""
