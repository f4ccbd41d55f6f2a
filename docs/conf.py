"""The site: `make docs` builds it from the repository's Markdown pages and the docstrings, into build/docs.

The source folder is the repository, so that a relative link holds on the site as it does among the files.
"""

import sys
from importlib.metadata import version as version_of
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

project = "ploughval"
author = "The ploughval developers"
copyright = author
version = release = version_of("ploughval")

root_doc = "docs/index"
include_patterns = [
    "docs/**",
    "reports/**/*.md",
    "benchmarks/README.md",
    "CHANGELOG.md",
    "CONTRIBUTING.md",
    "SECURITY.md",
]
exclude_patterns = ["build", "data", "dist", "src", "tests", ".*", "**/__pycache__"]
extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "numpydoc",
    "equations",
    "citations",
    "own_host",
    "open_pages",
    "reference",
]
nitpicky = True
smartquotes = False
language = "en"

# Markdown
myst_enable_extensions = ["dollarmath"]
myst_dmath_allow_space = False
myst_dmath_allow_digits = False
myst_heading_anchors = 4
html_math_renderer = "mathml"

# docstrings
autodoc_default_options = {"members": True, "member-order": "bysource"}
autodoc_typehints = "none"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True
numpydoc_class_members_toctree = False
numpydoc_show_class_members = False

# pages
html_theme = "furo"
html_title = f"ploughval {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False
html_additional_pages = {"index": "to-start.html"}
templates_path = ["_templates"]
