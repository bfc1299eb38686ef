"""Describe the processor for which machine code is compiled; another processor may round the last digit differently."""

from __future__ import annotations

import numba

from ..simd import lane_types


def processor() -> str:
    """Return name and features of the processor, as LLVM calls them, for example "znver3: aes avx avx2"."""
    # NUMBA_CPU_NAME, NUMBA_CPU_FEATURES and NUMBA_ENABLE_AVX choose another processor, for which Numba then compiles.
    name = numba.config.CPU_NAME or lane_types.HOST_NAME
    if numba.config.CPU_FEATURES is not None:
        features = [word[1:] for word in numba.config.CPU_FEATURES.split(",") if word.startswith("+")]
    else:
        present = [feature for feature, present in lane_types.HOST_FEATURES.items() if present]
        features = [feature for feature in present if numba.config.ENABLE_AVX or not feature.startswith("avx")]
    return f"{name}: {' '.join(sorted(features))}"


def told_apart(one: str, other: str) -> tuple[str, str]:
    """Return short descriptions of two processors, for a message that compares them: names, or features if these agree."""
    (name, _, features), (other_name, _, other_features) = one.partition(": "), other.partition(": ")
    if name != other_name:
        return name, other_name
    only = [sorted({*a.split()} - {*b.split()}) for a, b in ((features, other_features), (other_features, features))]
    first, second = (f"{name} with {' '.join(extra) or 'nothing more'}" for extra in only)
    return first, second
