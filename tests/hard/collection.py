"""All cases: every module of this package that has a list CASES."""

import importlib
import pkgutil

import hard
from hard.case import SECTIONS, Case


def all_cases() -> list[Case]:
    """In the order of the sections. Raises ValueError for a name or a section that cannot be."""
    found = []
    for module in sorted(entry.name for entry in pkgutil.iter_modules(hard.__path__)):
        if not module.startswith(("test_", "__")):
            found += getattr(importlib.import_module(f"hard.{module}"), "CASES", [])
    names = [case.name for case in found]
    if len(set(names)) < len(names):
        raise ValueError(f"one name for two cases: {sorted({name for name in names if names.count(name) > 1})}")
    return sorted(found, key=lambda case: SECTIONS.index(case.section))
