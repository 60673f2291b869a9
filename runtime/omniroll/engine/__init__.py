"""The engine: runs a vehicle from a start. Steps, events and the switching model."""
