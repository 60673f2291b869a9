"""What accuracy costs in time: reference solutions, integrators beside each other, laws, advice, figures."""
