"""Benchmarks of hpcdem: the workloads, the peers, and what is printed of them. Started by `scripts/bench`."""
