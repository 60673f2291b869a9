"""Sphinx's configuration, for the sources that assemble.py has made."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import rendering  # noqa: E402
import search_texts  # noqa: E402

import omniroll  # noqa: E402

project = "omniroll"
author = copyright = "omniroll authors"
version = release = omniroll.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.mathjax"]
html_theme = "furo"
html_title = f"omniroll {version}"
html_search_scorer = str(Path(__file__).parent / "search.js")
html_copy_source = html_show_sphinx = False
myst_enable_extensions = ["dollarmath"]
myst_fence_as_directive = ["math"]
myst_heading_anchors = 4
html_static_path = [str(Path(__file__).parent / "node_modules/mathjax/es5/tex-svg.js")]
mathjax_path = "tex-svg.js"  # of the site itself: no network is needed
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # shapes and units stand in the docstrings
python_use_unqualified_type_names = True


def setup(app):
    app.connect("autodoc-process-docstring", rendering.process_docstring)
    app.connect("autodoc-process-bases", rendering.process_bases)
    app.connect("html-page-context", search_texts.add_texts)
    app.connect("build-finished", search_texts.write_texts)
