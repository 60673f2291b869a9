"""Results: what a run leaves, how it is stored, and what is read off it."""
