"""Benchmarks against peers, one question a file; `make bench` runs them all and writes docs/benchmarks.md."""
