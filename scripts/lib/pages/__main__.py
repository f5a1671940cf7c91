"""Write every page and stub that is made from the package; the states of the online help first (`scripts/pages`)."""

from __future__ import annotations

from pathlib import Path

from scripts.lib.pages import chinese, fields, online, options, pcdc, python, stubs, zdem

DOCS = Path(__file__).parents[3] / "docs"
PAGES = {
    "options.md": options.page, "python_reference.md": python.page, "fields.md": fields.page,
    "zdem_reference.md": zdem.page, "pcdc_reference.md": pcdc.page, "pcdc_online.md": online.page,
    "zdem_reference.zh.md": chinese.zdem_page, "pcdc_reference.zh.md": chinese.pcdc_page,
}  # fmt: skip
"""What makes each page of docs/."""

if __name__ == "__main__":
    online.FILE.write_text(online.with_states(), "utf-8")
    online.rows.cache_clear()
    for name, page in PAGES.items():
        (DOCS / name).write_text(page(), "utf-8")
    for path, content in stubs.files().items():
        path.write_text(content, "utf-8")
