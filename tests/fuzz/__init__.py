"""Wrong arguments and wrong scenes by the thousand: each refused by a typed error, or run to finite numbers."""
