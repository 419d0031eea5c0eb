"""Check a built site by itself: its links lead somewhere, and it loads nothing from elsewhere.

    python scripts/check_links.py build/docs/html

Links to other hosts are counted and not followed; no network is needed.
"""

from __future__ import annotations

import argparse
import re
import sys
from dataclasses import dataclass, field
from html.parser import HTMLParser
from pathlib import Path
from typing import Final
from urllib.parse import unquote, urlsplit

LOADED: Final = {("link", "href"), ("script", "src"), ("img", "src"), ("iframe", "src")}
REFERENCES: Final = {*LOADED, ("a", "href"), ("source", "src"), ("object", "data")}
PASSIVE_LINKS: Final = {"canonical", "author", "license", "next", "prev", "search", "index"}
STYLE_ADDRESS: Final = re.compile(r"""(?:url\(\s*|@import\s+)["']?([^"')]+)""")


@dataclass
class Page(HTMLParser):
    """Collect what a page refers to, and the anchors that it has."""

    references: list[tuple[str, bool]] = field(default_factory=list)
    """Each address, and whether the browser loads it by itself."""
    anchors: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        super().__init__()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Take the addresses and anchors of one tag."""
        values = dict(attrs)
        for key in ("id", "name"):
            self.anchors.add(values.get(key) or "")
        for key, value in attrs:
            if (tag, key) in REFERENCES and value is not None:
                passive = tag == "link" and values.get("rel") in PASSIVE_LINKS
                self.references.append((value, (tag, key) in LOADED and not passive))


def read_page(path: Path) -> Page:
    """Read one page."""
    page = Page()
    page.feed(path.read_text(encoding="utf-8"))
    return page


def faults(site: Path) -> tuple[list[str], int]:
    """Return what is wrong with the site, a line each, and how many addresses were looked at."""
    pages = {path.resolve(): read_page(path) for path in sorted(site.rglob("*.html"))}
    found: list[str] = []
    looked_at = 0
    for path, page in pages.items():
        for address, loaded in page.references:
            looked_at += 1
            why = fault(address, path, pages, loaded=loaded)
            if why:
                found.append(f"{path.relative_to(site.resolve())}: {address}: {why}")
    for style in sorted(site.rglob("*.css")):
        for address in STYLE_ADDRESS.findall(style.read_text(encoding="utf-8")):
            looked_at += 1
            why = fault(address, style.resolve(), pages, loaded=True)
            if why:
                found.append(f"{style.relative_to(site)}: {address}: {why}")
    return found, looked_at


def fault(address: str, source: Path, pages: dict[Path, Page], *, loaded: bool) -> str:
    """Return what is wrong with one address in the file `source`; "" for nothing."""
    parts = urlsplit(address)
    if parts.scheme == "data":
        return ""
    if parts.scheme or parts.netloc:
        return "loaded from another host" if loaded else ""
    target = (source.parent / unquote(parts.path)).resolve() if parts.path else source
    if not target.is_file():
        return "no such file"
    if parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].anchors:
        return "no such place on that page"
    return ""


def main() -> int:
    """Check the site that the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("site", type=Path)
    site = parser.parse_args().site
    if not (site / "index.html").is_file():
        sys.exit(f"check_links: {site}: no site: index.html is missing")
    found, looked_at = faults(site)
    for line in found:
        print(line)
    print(f"links and assets: {looked_at} looked at, {len(found)} broken")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
