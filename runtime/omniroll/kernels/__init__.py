"""Kernels: the generated functions of a set of effects, in C and in Python, as methods on arrays."""
