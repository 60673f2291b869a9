"""Vehicles: their numbers, the parts that these follow from, and their state between switches."""
