"""What the site needs beyond MkDocs: math without a network, and the repository's own root pages.

Formulas are written between dollar signs, as git hosts show them, and become MathML when the site is
built. README, CONTRIBUTING, CHANGELOG, LICENSE and the benchmarks' page stand outside `docs/`; they join
the site, and links between them and the pages are turned accordingly.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path
from typing import Any

import latex2mathml.converter
from markdown import Markdown
from markdown.extensions import Extension
from markdown.inlinepatterns import InlineProcessor
from mkdocs.structure.files import File

ROOT = Path(__file__).resolve().parents[1]

ROOT_PAGES = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "CONTRIBUTING.md",
    "CHANGELOG.md": "CHANGELOG.md",
    "bench/README.md": "bench/README.md",
    "LICENSE": "LICENSE",
}
"""Where the files of the repository's root stand in the site."""

RESULTS = "bench/results/"
"""The benchmarks' pictures, which stand in the site as they do in the repository."""

DISPLAYED = r"\$\$(.+?)\$\$"
# As on git hosts: no blank inside the dollars, and no digit after them, so that prices stay prices.
INLINE = r"(?<![\\$\w])\$(?!\s)([^$]+?)(?<!\s)\$(?![\d$])"

ITEM = re.compile(r"\d+\. ")
FENCE = "```"

LINK = re.compile(r"(\]\(|src=\")([^)\"\s#:]+)")


class Formula(InlineProcessor):
    """Turns what stands between dollar signs into MathML."""

    def __init__(self, pattern: str, display: str, markdown: Markdown) -> None:
        super().__init__(pattern, markdown)
        self.display = display

    def handleMatch(self, m: re.Match[str], data: str) -> tuple[str, int, int]:  # noqa: ARG002, N802
        """Keep the converted formula from the patterns that follow."""
        latex = self.unescape(m.group(1)).strip()
        formula = latex2mathml.converter.convert(latex, display=self.display)
        return self.md.htmlStash.store(formula), m.start(0), m.end(0)


class Formulas(Extension):
    """Registers `$…$` and `$$…$$`, after code in backticks and before everything else."""

    def extendMarkdown(self, md: Markdown) -> None:  # noqa: N802
        """Called by Markdown."""
        md.inlinePatterns.register(Formula(DISPLAYED, "block", md), "displayed-math", 188)
        md.inlinePatterns.register(Formula(INLINE, "inline", md), "inline-math", 187)


def on_config(config: Any) -> Any:
    """Add the math to Markdown's extensions."""
    config.markdown_extensions += [Formulas()]
    return config


def on_files(files: Any, config: Any) -> Any:
    """Add the pages of the repository's root, and the benchmarks' pictures."""
    for name, uri in ROOT_PAGES.items():
        files.append(File.generated(config, uri, content=(ROOT / name).read_text(encoding="utf-8")))
    for picture in sorted((ROOT / RESULTS).iterdir()):
        if picture.suffix in (".png", ".jpg"):
            files.append(File.generated(config, RESULTS + picture.name, abs_src_path=str(picture)))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Turn links between `docs/` and the repository's root into links of the site."""
    uri = page.file.src_uri
    of_root = {site: name for name, site in ROOT_PAGES.items()}
    in_repository = of_root.get(uri, f"docs/{uri}")

    def turned(match: re.Match[str]) -> str:
        return match.group(1) + site_link(match.group(2), in_repository, uri)

    return LINK.sub(turned, deepened(markdown))


def deepened(markdown: str) -> str:
    """Indent what belongs to numbered items by four, and their code by eight, as Markdown's library wants it.

    Git hosts are content with the three that "1. " takes, and with fences inside items.
    """
    lines = []
    in_item = in_code = loose = False
    for line in markdown.split("\n"):
        nested = line.startswith("   ")
        if ITEM.match(line):
            # After a paragraph of the item before, the next one would go on with it.
            lines += [""] * (in_item and loose)
            in_item, loose = True, False
        elif line.strip() and not nested:
            in_item = False
        loose |= not line
        if not (in_item and nested):
            lines.append(line)
        elif line.strip().startswith(FENCE):
            in_code = not in_code
        else:
            lines.append(("     " if in_code else " ") + line)
    return "\n".join(lines)


def site_link(target: str, in_repository: str, in_site: str) -> str:
    """Return a link of the page at `in_repository` as a link of the same page at `in_site`."""
    path = posixpath.normpath(posixpath.join(posixpath.dirname(in_repository), target))
    if path.startswith("docs/"):
        uri = path.removeprefix("docs/")
    elif path in ROOT_PAGES:
        uri = ROOT_PAGES[path]
    elif path.startswith(RESULTS):
        uri = path
    else:
        return target
    return posixpath.relpath(uri, posixpath.dirname(in_site) or ".")
