"""How the documentation is built: `scripts/docs`. Nothing is fetched, neither here nor by whoever reads it."""

import pathlib
import sys

import caregiver_mj
import caregiver_mj.house  # dm_control logs what it imports: now, and not among Sphinx's warnings

sys.path.insert(0, str(pathlib.Path(__file__).parent / "_ext"))

project = "caregiver_mj"
author = "The caregiver_mj authors"
release = caregiver_mj.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "mathml", "untyped"]
exclude_patterns = ["_build"]
default_role = "py:obj"  # `Name` in a docstring leads to what has that name, if anything does
_INSIDE = (
    "BaseMotion|ChildrenLike|CommandedCaregiver|Navigator|OffscreenRendering|"
    "PrivilegedCaregiver|RetrievalPlanner|Value|WorkerError"
)
nitpick_ignore_regex = [
    ("py:obj", ".*"),
    ("py:class", r"(np|numpy|pd|pandas|pathlib|abc|collections|enum|importlib|dm_control|gymnasium)\..*"),  # of others
    ("py:(class|exc)", rf"(.*\.)?({_INSIDE})"),  # what has no page
]

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
smartquotes = False
html_math_renderer = "mathml"

autodoc_inherit_docstrings = False  # those of other libraries are not ours to format
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "show-inheritance": True}
autodoc_typehints = "none"  # the docstrings say it in words, with shapes and units
napoleon_numpy_docstring = False
napoleon_use_ivar = True

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
