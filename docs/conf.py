"""The documentation site: `sphinx-build -W docs build/site`. Pages of the gallery and of the elements are made first."""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))  # for `pages`, which writes the pages that come from code

project, author, copyright = "Buckler", "The Buckler authors", "2026, The Buckler authors"
extensions = ["myst_parser", "sphinx.ext.mathjax", "sphinx_design", "sphinx_copybutton"]
source_suffix = {".md": "markdown"}
exclude_patterns = ["gallery/*", "paper/*"]
myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 3
html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_title = "Buckler"
html_theme_options = {"top_of_page_buttons": []}
copybutton_exclude = ".linenos, .gp"


def setup(app):
    """Write the pages that are made of code, before the others are read."""
    from pages import write_pages

    app.connect("builder-inited", lambda _: write_pages(HERE))
