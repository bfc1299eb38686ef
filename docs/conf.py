"""How Sphinx builds the site: ``sphinx-build -W docs out/site``; the network is not needed."""

from __future__ import annotations

import os
import sys
from importlib.metadata import version as version_of
from pathlib import Path

from numpydoc.xref import DEFAULT_LINKS

import synchain

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

project = "synchain"
author = "The synchain developers"
version = release = version_of("synchain")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
    "mathml",
    "checked_links",
    "families",
    "package_words",
    "recipes",
    "offline_animations",
]
if "READTHEDOCS" in os.environ:  # links to other projects and cards for messengers need the network and an address
    extensions += ["sphinx.ext.intersphinx", "sphinxext.opengraph"]
    intersphinx_mapping = {
        "python": ("https://docs.python.org/3", None),
        "numpy": ("https://numpy.org/doc/stable", None),
        "scipy": ("https://docs.scipy.org/doc/scipy", None),
        "sympy": ("https://docs.sympy.org/latest", None),
        "matplotlib": ("https://matplotlib.org/stable", None),
        "xarray": ("https://docs.xarray.dev/en/stable", None),
        "networkx": ("https://networkx.org/documentation/stable", None),
    }
    ogp_site_url = os.environ.get("READTHEDOCS_CANONICAL_URL", "")
    ogp_social_cards = {"enable": False}
exclude_patterns = ["gallery/README.rst", "tutorial/README.rst", "sg_execution_times.rst"]

# Pages
myst_enable_extensions = ["dollarmath", "deflist", "colon_fence"]
myst_heading_anchors = 4
html_theme = "furo"
html_title = f"synchain {version}"
html_theme_options = {"top_of_page_buttons": []}
html_static_path = ["static"]
html_logo = html_favicon = "static/logo.svg"
html_css_files = ["site.css"]
html_js_files = ["focus.js"]
html_math_renderer = "mathml"
html_copy_source = False
html_show_sourcelink = False
html_show_copyright = False
pygments_style = "a11y-high-contrast-light"  # of accessible-pygments, which furo brings
pygments_dark_style = "a11y-high-contrast-dark"

# Reference
autodoc_typehints = "none"  # the docstrings say types in words, with shapes and units
autodoc_member_order = "bysource"
autosummary_generate = False
numpydoc_show_class_members = False  # `:members:` shows them
numpydoc_xref_param_type = True  # types of arguments and results are links
numpydoc_xref_ignore = {"of", "or", "optional", "shape"}
numpydoc_xref_aliases = {
    **({} if "READTHEDOCS" in os.environ else {name: name for name in DEFAULT_LINKS}),  # no inventories offline
    **{name: f"synchain.{name}" for name in synchain.__all__ if name[0].isupper()},
    **{name: f"synchain.{part}.{name}" for part in synchain.MODULES for name in getattr(synchain, part).HOMES},
}
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True

# Tutorial and gallery: plain files that run when the site is built; what raises fails the build
sphinx_gallery_conf = {
    "examples_dirs": ["tutorial", "gallery", "../runtime/papers"],
    "gallery_dirs": ["built/tutorial", "built/gallery", "built/papers"],
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
