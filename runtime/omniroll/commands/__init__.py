"""The commands of `omniroll`, one module each; omniroll.cli says what such a module has."""
