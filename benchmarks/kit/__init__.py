"""What the benchmarks share: cases, clocks and comparisons."""
