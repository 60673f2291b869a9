"""Reactions against Newton and Euler, body by body."""
