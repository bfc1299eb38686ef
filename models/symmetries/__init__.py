"""What of a graph may move alike: balanced partitions, automorphisms, cluster states. Knows no oscillator."""
