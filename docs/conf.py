"""How Sphinx makes the site (``python docs/make_site.py``).

Its sources are the Markdown files where they lie, README.md and SPEC.md too. So the root of the project is
Sphinx' source folder, and links between the files lead to the same places on GitHub and on the site.
"""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "src")]

from site_tools import commands, reference  # noqa: E402  (the folders above have to be known first)

from upholster import __version__  # noqa: E402

if TYPE_CHECKING:
    from docutils.nodes import document
    from sphinx.application import Sphinx

project = "upholster"
author = "the maintainers of upholster"
version = release = __version__

root_doc = "docs/index"
include_patterns = ["*.md", "docs/**", "web/README.md", "web/examples/README.md", "examples/LICENSE.md"]
exclude_patterns = [".*", "build", "dist", "**/node_modules", "src", "tests", "benchmarks"]

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_heading_anchors = 4
suppress_warnings = [
    "myst.header",  # pages may go from a title to a small heading
    "misc.highlighting_failure",  # of shortened JSON and console sessions
]

autodoc_member_order = "bysource"
autodoc_typehints = "description"  # signatures with all types are half a page
autodoc_typehints_description_target = "documented"
autodoc_typehints_format = "short"
autodoc_default_options = {"members": True}
napoleon_google_docstring = False
napoleon_use_ivar = True  # fields of options and of results are lists, not sections

default_role = "py:obj"  # `Sample` in a docstring leads to that name, where the page has it
smartquotes = False  # they make one long dash of the two in front of an option

html_theme = "furo"
html_static_path = ["site_tools/static"]
html_css_files = ["site.css"]
html_title = f"upholster {__version__}"
html_extra_path = ["site_tools/root"]
html_copy_source = False
html_show_copyright = False

GENERATED = {"docs/commands": commands.markdown, "docs/reference": reference.markdown}
MARK = "<!-- made from the program -->"


def fill_in(_app: "Sphinx", page: str, source: list[str]) -> None:
    """Put what is made from the program where a page has the mark for it."""
    if page in GENERATED:
        before, mark, after = source[0].partition(MARK)
        if not mark:
            raise ValueError(f"{page}.md lacks the line {MARK}")
        source[0] = before + GENERATED[page]() + after


def set_dashes(_app: "Sphinx", page: "document") -> None:
    """Set a dash between a parameter and its meaning: Sphinx leaves that to `smartquotes`."""
    from docutils.nodes import Text

    for text in list(page.findall(Text)):
        if text == " -- ":
            text.parent.replace(text, Text(" – "))


def setup(app: "Sphinx") -> None:
    """Tell Sphinx what changes pages on their way."""
    app.connect("source-read", fill_in)
    app.connect("doctree-read", set_dashes)
