"""How Sphinx builds the site: ``sphinx-build -W docs out/site``; the network is not needed."""

from __future__ import annotations

import sys
from importlib.metadata import version as version_of
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

project = "synchain"
author = "The synchain developers"
version = release = version_of("synchain")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "sphinx_gallery.gen_gallery",
    "mathml",
    "checked_links",
    "families",
    "package_words",
    "recipes",
    "offline_animations",
]
exclude_patterns = ["gallery/README.rst", "tutorial/README.rst", "sg_execution_times.rst"]

# Pages
myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 4
html_theme = "furo"
html_title = f"synchain {version}"
html_theme_options = {"top_of_page_buttons": []}
html_static_path = ["static"]
html_css_files = ["site.css"]
html_math_renderer = "mathml"
html_copy_source = False
html_show_sourcelink = False
html_show_copyright = False
pygments_style = "friendly"
pygments_dark_style = "github-dark"

# Reference
autodoc_typehints = "none"  # the docstrings say types in words, with shapes and units
autodoc_member_order = "bysource"
autosummary_generate = False
numpydoc_show_class_members = False  # `:members:` shows them

# Tutorial and gallery: plain files that run when the site is built; what raises fails the build
sphinx_gallery_conf = {
    "examples_dirs": ["tutorial", "gallery"],
    "gallery_dirs": ["built/tutorial", "built/gallery"],
    "filename_pattern": r"\.py$",
    "within_subsection_order": "FileNameSortKey",
    "capture_repr": ("_repr_html_",),
    "ignore_repr_types": r"matplotlib|xarray",
    "download_all_examples": False,
    "show_signature": False,
    "min_reported_time": 1e9,
    "write_computation_times": False,
    "abort_on_example_error": True,
    "image_srcset": ["2x"],
    "matplotlib_animations": (True, "jshtml"),
    "thumbnail_size": (500, 210),  # the shape of most figures
    "parallel": 2,
    "run_stale_examples": True,  # the package may have changed though the example has not
}
