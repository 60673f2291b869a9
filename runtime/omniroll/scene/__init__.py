"""Scenes: TOML files that say what there is. docs/scenes.md describes them; omniroll.scene.schema is the list."""

from omniroll.scene.loading import Scene, load_scene, run
from omniroll.scene.problems import Problem, SceneError

__all__ = ["Problem", "Scene", "SceneError", "load_scene", "run"]
