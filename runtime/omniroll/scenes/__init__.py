"""Scenes: TOML files that say what there is. docs/scenes.md describes them; omniroll.scenes.schema is the list."""

from omniroll.scenes.loading import Scene, load_scene, run
from omniroll.scenes.problems import Problem, SceneError

__all__ = ["Problem", "Scene", "SceneError", "load_scene", "run"]
