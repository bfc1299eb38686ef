"""`synchain scenes`: the scenes that come with the package."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ..console.outcome import FINE

SUMMARY = "list the scenes that come with the package"
EXAMPLES = ("synchain scenes",)


def configure(parser: ArgumentParser) -> None:
    """No arguments."""


def execute(arguments: Namespace) -> int:
    """Print name and title of every scene."""
    import tomllib
    from importlib import resources

    from synchain.models.scenes.file import scene_names

    folder = resources.files("synchain.models.scenes.library")
    wide = max(map(len, scene_names()))
    for name in scene_names():
        title = tomllib.loads(folder.joinpath(f"{name}.toml").read_text(encoding="utf-8")).get("title", "")
        print(f"{name:<{wide}}  {title}".rstrip())
    return FINE
