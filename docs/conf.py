"""Settings of `scripts/docs`. Neither the build nor a page fetches anything."""

import pathlib
import sys

import caregiver_mj

sys.path.insert(0, str(pathlib.Path(__file__).parent / "_ext"))

project = "caregiver_mj"
author = "The caregiver_mj authors"
release = caregiver_mj.__version__

extensions = ["myst_parser", "mathml"]
exclude_patterns = ["_build"]

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
smartquotes = False
html_math_renderer = "mathml"

html_theme = "furo"
html_title = f"caregiver_mj {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_copyright = False
html_show_sphinx = False
html_theme_options = {"footer_icons": []}

_INCLUDED = {"(../examples/README.md)": "(guide/examples.md)"}  # pages from elsewhere, and where they are here


def _lead_to_what_is_included(app, docname, source):
    """Study pages stand in the checkout as they are; what they link to outside of this folder has a page here."""
    for elsewhere, here in _INCLUDED.items():
        source[0] = source[0].replace(elsewhere, here)


def setup(app):
    """Sees to links out of this folder."""
    app.connect("source-read", _lead_to_what_is_included)
