"""Settings of Sphinx for the site: `scripts/docs`. Why Sphinx: docs/writing.md.

Sources are the Markdown pages of docs/ and of the root, as they can be read in the repository too; what only the site
needs (navigation, the switch of languages, pictures of examples) is put in here.
"""

from __future__ import annotations

import re
import sys
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(HERE))

from navigation import NAVIGATION  # noqa: E402

project = "hpcdem"
author = "hpcdem"
copyright = "hpcdem, MIT licence"
root_doc = "docs/index"
extensions = ["myst_parser", "sphinx_design", "sphinx_copybutton", "formulas", "search_words"]
include_patterns = ["docs/**", *(f"{page}.md" for page in ("ARCHITECTURE", "CONTRIBUTING", "CHANGELOG"))]
exclude_patterns = ["docs/site/**", "docs/figures/**", ".*", "**/.*", "build", "tests", "hpcdem"]

myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 4  # the anchors that repositories make of headings
myst_links_external_new_tab = False
suppress_warnings = ["misc.highlighting_failure"]
highlight_language = "text"

language = "en"
html_theme = "furo"
html_title = "hpcdem"
html_static_path = ["static"]
templates_path = ["templates"]
html_css_files = ["site.css"]
html_favicon = "../../hpcdem/page/static/icon.svg"
html_logo = "../../hpcdem/page/static/icon.svg"
html_copy_source = False
html_show_sphinx = False
html_math_renderer = "mathml"
html_theme_options = {"top_of_page_buttons": []}
html_sidebars = {
    "**": [
        "sidebar/brand.html", "sidebar/language.html", "sidebar/search.html", "sidebar/scroll-start.html",
        "sidebar/navigation.html", "sidebar/scroll-end.html",
    ]
}  # fmt: skip


def _with_navigation(app: Any, docname: str, source: list[str]) -> None:
    """The tree of pages, at the end of the home page; where README is linked, the home page."""
    text = source[0]
    if docname == root_doc:
        for caption, pages in NAVIGATION.items():
            text += f"\n```{{toctree}}\n:hidden:\n:caption: {caption}\n\n" + "\n".join(f"/{page}" for page in pages)
            text += "\n```\n"
    up = "" if "/" not in docname else "../" * (docname.count("/") - 1)
    home = {"README.md": "docs/index.md", "README.zh.md": "docs/index.zh.md"}
    for readme, page in home.items():
        text = re.sub(rf"\]\((?:\.\./)*{re.escape(readme)}", f"]({up}{page.removeprefix('docs/')}", text)
    # Folders and directories of sources are no pages: their names stay as text.
    text = re.sub(r"\[([^\]]+)\]\((?:\.\./)+(?:examples|tests|slurm|packaging)/?\)", r"\1", text)
    source[0] = text


def _languages(app: Any, pagename: str, templatename: str, context: dict[str, Any], doctree: Any) -> None:
    """The language of a page, and the same page in the other one where there is one."""
    chinese = pagename.endswith(".zh")
    twin = pagename.removesuffix(".zh") if chinese else f"{pagename}.zh"
    there = twin in app.env.all_docs
    if chinese:
        context["language"] = "zh-CN"
    if not there:
        twin = "docs/index" if chinese else "docs/index.zh"
    context["twin"], context["twin_name"] = context["pathto"](twin), "English" if chinese else "中文"


def _redirect(app: Any, exception: Exception | None) -> None:
    """index.html of the folder goes to the home page."""
    if exception is None:
        home = '<meta http-equiv="refresh" content="0; url=docs/index.html">'
        Path(app.outdir, "index.html").write_text(f"<!DOCTYPE html>{home}<a href='docs/index.html'>hpcdem</a>\n")


def setup(app: Any) -> None:
    app.connect("source-read", _with_navigation)
    app.connect("html-page-context", _languages)
    app.connect("build-finished", _redirect)
