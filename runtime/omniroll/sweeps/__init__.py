"""Sweeps: many runs of simulate in threads or on an executor, arrays in and arrays out."""
