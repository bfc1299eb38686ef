"""The kind of processor that machine code is made for.

Another kind may round the last digit of a result differently.
"""

from __future__ import annotations

import numba

from ..simd import lane_types


def processor() -> str:
    """Return name and features of the processor, as LLVM calls them, for example "znver3: aes avx avx2".

    Notes
    -----
    NUMBA_CPU_NAME, NUMBA_CPU_FEATURES and NUMBA_ENABLE_AVX choose another kind, for which Numba
    then compiles.
    """
    name = numba.config.CPU_NAME or lane_types.HOST_NAME
    if numba.config.CPU_FEATURES is not None:
        features = [word[1:] for word in numba.config.CPU_FEATURES.split(",") if word.startswith("+")]
    else:
        known = lane_types.HOST_FEATURES.items()
        features = [
            word for word, present in known if present and (numba.config.ENABLE_AVX or not word.startswith("avx"))
        ]
    return f"{name}: {' '.join(sorted(features))}"


def told_apart(one: str, other: str) -> tuple[str, str]:
    """Describe two kinds of processor in few words, for a message that compares them."""
    (name, _, features), (other_name, _, other_features) = one.partition(": "), other.partition(": ")
    if name != other_name:
        return name, other_name
    return _more(name, features, other_features), _more(name, other_features, features)


def _more(name: str, features: str, fewer: str) -> str:
    more = sorted(set(features.split()) - set(fewer.split()))
    return f"{name} with {' '.join(more) or 'nothing more'}"
