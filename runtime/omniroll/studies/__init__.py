"""Studies: many runs that answer one question, with tables and pictures."""
