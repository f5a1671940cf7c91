"""Search in English and Chinese at once: English words by their stems, Chinese by pairs of neighbouring characters."""

from __future__ import annotations

import re
from typing import Any

from sphinx.search import languages
from sphinx.search.en import SearchEnglish

HAN = "\u4e00-\u9fff"
_PARTS = re.compile(rf"[{HAN}]+|[^\W{HAN}]+")


def pairs(text: str) -> list[str]:
    """`推覆带` is found by `推覆` and `覆带`; a single character by itself."""
    return [text] if len(text) == 1 else [text[k : k + 2] for k in range(len(text) - 1)]


class SearchBoth(SearchEnglish):
    # The browser takes a query apart in the same way.
    js_splitter_code = """
function splitQuery(query) {
  const words = [];
  for (const part of query.match(/[\\u4e00-\\u9fff]+|[^\\s\\u4e00-\\u9fff"'`(){}\\[\\],.;:=<>\\/|-]+/gu) || []) {
    if (!/[\\u4e00-\\u9fff]/.test(part) || part.length === 1) words.push(part);
    else for (let k = 0; k + 1 < part.length; k++) words.push(part.slice(k, k + 2));
  }
  return words;
}
"""

    def split(self, text: str) -> list[str]:
        words: list[str] = []
        for part in _PARTS.findall(text):
            words += pairs(part) if "\u4e00" <= part[0] <= "\u9fff" else [part]
        return words


def setup(app: Any) -> dict[str, bool]:
    languages["en"] = SearchBoth
    return {"parallel_read_safe": True, "parallel_write_safe": True}
