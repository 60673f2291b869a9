"""Hard cases: each held to a number, and measured. `python -m hard` from tests/ writes docs/hard-cases.md."""
