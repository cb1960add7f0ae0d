#!/usr/bin/env python3
"""Links of the book's pages, for scripts/book.

usage: book_pages.py link FOLDER     make links into the repository links to texts in FOLDER/code, before mdBook builds
       book_pages.py check FOLDER    hold every link of the built pages against what is there, and find none that needs a network
"""

import html.parser
import os
import re
import shutil
import sys
import urllib.parse

LINK = re.compile(r"\]\(([^)#\s]+)(#[^)]*)?\)")


def text_page(pages, path):
    """Copies a file, or the names in a folder, as a text. Returns its place below `pages`."""
    # mdBook takes what has .md in its name for a chapter, and README for the first page.
    name = os.path.join("code", path.removesuffix(".md") + ".txt")
    target = os.path.join(pages, name)
    os.makedirs(os.path.dirname(target), exist_ok=True)
    if os.path.isdir(path):
        with open(target, "w") as out:
            out.write("\n".join(sorted(os.listdir(path))) + "\n")
    else:
        shutil.copyfile(path, target)
    return name


def link_page(pages, page):
    """Rewrites the links of one page, which lead from its file's place in the repository."""
    folder, name = os.path.split(page)
    place = os.path.relpath(folder, pages)
    home = "book/src" if place == "." and os.path.exists(os.path.join("book/src", name)) else place

    def rewrite(match):
        path, anchor = match.group(1), match.group(2) or ""
        beside = os.path.normpath(os.path.join(folder, path))
        if "://" in path or (beside.startswith(pages + os.sep) and os.path.exists(beside)):
            return match.group(0)
        source = os.path.normpath(os.path.join(home, path))
        if source.startswith("..") or not os.path.exists(source):
            sys.exit(f"book: {page} links to {path}, which is not there")
        # A chapter or a document that has a page, named from where its file lies in the repository.
        for prefix in ("book/src/", ""):
            if source.startswith(prefix) and os.path.isfile(os.path.join(pages, source[len(prefix):])):
                return f"]({os.path.relpath(os.path.join(pages, source[len(prefix):]), folder)}{anchor})"
        return f"]({os.path.relpath(os.path.join(pages, text_page(pages, source)), folder)})"

    with open(page) as text:
        # Not within blocks of code.
        parts = text.read().split("```")
    parts[::2] = [LINK.sub(rewrite, part) for part in parts[::2]]
    with open(page, "w") as text:
        text.write("```".join(parts))


def link(pages):
    found = [os.path.join(folder, name) for folder, _, names in os.walk(pages) for name in names if name.endswith(".md")]
    for page in found:
        link_page(pages, page)


class Page(html.parser.HTMLParser):
    """The links of a page, and what links can lead to in it."""

    def __init__(self, path):
        super().__init__()
        self.links, self.ids = [], set()
        with open(path) as text:
            self.feed(text.read())

    def handle_starttag(self, tag, attributes):
        for key, value in attributes:
            if key in ("id", "name") and value:
                self.ids.add(value)
            # A reader may follow links to other sites; whatever the page itself needs must be there.
            if key in ("href", "src") and value and not (tag == "a" and "://" in value):
                self.links.append(value)


def check(pages):
    parsed = {}

    def page_of(path):
        if path not in parsed:
            parsed[path] = Page(path)
        return parsed[path]

    broken, count = [], 0
    found = [os.path.join(folder, name) for folder, _, names in os.walk(pages) for name in names if name.endswith(".html")]
    # The page for what is not there has links from a site's root; one page has all chapters, for printing.
    for path in sorted(name for name in found if os.path.basename(name) not in ("404.html", "print.html", "toc.html")):
        for value in page_of(path).links:
            count += 1
            if value.startswith(("data:", "mailto:")):
                continue
            place, _, anchor = value.partition("#")
            target = os.path.normpath(os.path.join(os.path.dirname(path), urllib.parse.unquote(place))) if place else path
            if "://" in value or not os.path.exists(target):
                broken.append(f"{path}: {value}")
            elif anchor and target.endswith(".html") and urllib.parse.unquote(anchor) not in page_of(target).ids:
                broken.append(f"{path}: {value} (no such heading)")
    print(f"book: {len(found)} pages, {count} links, {len(broken)} broken")
    if broken:
        sys.exit("\n".join(broken))


if __name__ == "__main__":
    commands = {"link": link, "check": check}
    if len(sys.argv) != 3 or sys.argv[1] not in commands:
        sys.exit(__doc__)
    commands[sys.argv[1]](sys.argv[2])
