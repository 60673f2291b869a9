"""Packages that only some users need: the extras of pyproject.toml. They are imported where they are used."""

import importlib
from types import ModuleType

from omniroll.errors import MissingPackageError


def needed(package: str, extra: str, purpose: str) -> ModuleType:
    """The module of a package that an extra installs. Raises MissingPackageError, which says what to install.

    purpose  what needs it, the subject of a sentence
    """
    try:
        return importlib.import_module(package)
    except ImportError as error:
        if error.name is not None and error.name.split(".")[0] != package.split(".")[0]:
            raise  # it is there, and lacks something itself
        raise MissingPackageError(package, extra, purpose) from error
