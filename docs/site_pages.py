"""Hooks of mkdocs: pages of the root folder join the site, and links to what is no page lead to the repository."""

import html
import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[1]
JOINED = ("README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md")

_ROW = re.compile(r"^\|.*$", re.M)
_CODE = re.compile(r"`([^`]+)`")
_LINK = re.compile(r"(!?)\[([^\]]*)\]\((?!https?://|#)([^)\s]+)\)")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages of the root folder."""
    for name in JOINED:
        files.append(File.generated(config, name, content=(ROOT / name).read_text(encoding="utf-8")))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Let each link lead to a page of the site; what is none there (a source file, a folder) is named in place.

    Code in tables has its bars without the backslash that GitHub takes off.
    """
    folder = ROOT if page.file.src_uri in JOINED else Path(config.docs_dir)

    def mended(link: re.Match[str]) -> str:
        mark, text, target = link.groups()
        file, _, anchor = target.partition("#")
        path = (folder / file).resolve()
        for base in (Path(config.docs_dir), ROOT):
            name = path.relative_to(base).as_posix() if path.is_relative_to(base) else ""
            if files.get_file_from_path(name):
                return f"{mark}[{text}]({name}{'#' + anchor if anchor else ''})"
        return f"{text} (`{path.relative_to(ROOT)}`)"

    return _ROW.sub(lambda row: _CODE.sub(_with_bars, row[0]), _LINK.sub(mended, markdown))


def _with_bars(code: re.Match[str]) -> str:
    """Code in a table whose bars are escaped: mkdocs would show the backslash, which GitHub does not."""
    bar = r"\|"
    return f"<code>{html.escape(code[1]).replace(bar, '&#124;')}</code>" if bar in code[1] else code[0]
