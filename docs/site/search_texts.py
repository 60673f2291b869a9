"""Texts of all pages for the search of the site, which shows the lines that it finds: search.js."""

import json
from pathlib import Path

FILE = "search-texts.js"


def add_texts(app, pagename: str, template, context, doctree) -> None:
    """The page of the search reads the texts before it searches."""
    if pagename == "search":
        app.add_js_file(FILE, priority=100)


def write_texts(app, error) -> None:
    """Write the text of each page by its name, where the build went well."""
    if error is None:
        texts = {name: app.env.get_doctree(name).astext() for name in sorted(app.env.found_docs)}
        file = Path(app.outdir, "_static", FILE)
        file.write_text(f"const SEARCH_TEXTS = {json.dumps(texts)};\n", encoding="utf-8")
