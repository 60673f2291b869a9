"""From what a robot has recorded to the numbers of its model, and from these numbers to what drives it."""
