"""Settings of `scripts/docs`. Neither the build nor a page fetches anything."""

import pathlib
import re
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

# Links from pages to files outside of this folder, and the pages here that include these files.
_INCLUDED = {"(../examples/README.md)": "(guide/examples.md)"}


def _prepare(app, docname, source):
    """Point links to included files at the pages that include them; keep each interval in a table on one line."""
    for elsewhere, here in _INCLUDED.items():
        source[0] = source[0].replace(elsewhere, here)
    whole = "\\1\N{NO-BREAK SPACE}to\N{NO-BREAK SPACE}\\2"
    source[0] = re.sub(r"^\|.*", lambda row: re.sub(r"(\(\S+) to (\S+\))", whole, row[0]), source[0], flags=re.M)


def setup(app):
    """Connect the preparation of sources."""
    app.connect("source-read", _prepare)
