"""Real robots: their numbers, each with its source, or marked as an assumption with its reasoning."""
