"""Hook of mkdocs: the pages are where the tree has them, and their links are those that work in the tree, too.

- Every README.md, docs/*.md and the files that they show are pages of the same paths; api/ is made of the headers (api.py).
- A link to a folder leads to its README; a link to any other file of the tree becomes its text.
- A paragraph that is nothing but a link to a source file shows the file.
- A bar in code in a table is written `\\|` for GitHub, and shown as a bar.
- A link or an anchor that leads nowhere is a warning, which `strict` makes an error.
"""
import html.parser
import logging
import pathlib
import posixpath
import re
import sys
import tempfile
import urllib.parse

ROOT = pathlib.Path(__file__).resolve().parents[2]
PARTS = ("common", "docs", "experiments", "hw", "launch", "models", "nodes", "proto", "python", "tests", "tools")
LANGUAGES = {".cc": "cpp", ".h": "cpp", ".proto": "proto", ".py": "python", ".txt": "cmake", ".yaml": "yaml"}
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^()\s]+)\)")
log = logging.getLogger("mkdocs.pages")
seen = {}  # page -> (ids, links)
made = tempfile.TemporaryDirectory(prefix="pages-")  # sources of pages that the tree has not


def pages():
    """Paths of all pages within the tree."""
    found = [p for part in PARTS for p in (ROOT / part).rglob("README.md")] + [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md")]
    return sorted({p.relative_to(ROOT).as_posix() for p in found})


def on_files(files, config):
    from mkdocs.structure.files import File, Files  # here, because the tests read pages() without mkdocs
    shown = [p.relative_to(ROOT).as_posix() for kind in ("png", "svg", "css") for p in (ROOT / "docs").rglob(f"*.{kind}")]
    theme = [f for f in files if not f.abs_src_path.startswith(str(ROOT))]
    sys.path.insert(0, str(pathlib.Path(__file__).parent))
    import api
    for name, text in api.pages(ROOT, lambda line: log.warning("%s", line)).items():
        pathlib.Path(made.name, "api").mkdir(exist_ok=True)
        pathlib.Path(made.name, "api", f"{name}.md").write_text(text, encoding="utf-8")
    return Files(theme + [File(path, folder, config.site_dir, config.use_directory_urls) for folder, paths in (
        (str(ROOT), pages() + shown), (made.name, [f"api/{p.name}" for p in pathlib.Path(made.name, "api").iterdir()])) for path in paths])


def on_page_markdown(text, page, config, files):
    here = posixpath.dirname(page.file.src_uri)

    def place(link):
        return posixpath.normpath(posixpath.join(here, link))

    def leads(match):
        image, label, link = match.groups()
        path, _, anchor = link.partition("#")
        if not path or ":" in path:
            return match[0]
        if (ROOT / place(path) / "README.md").is_file():
            path = posixpath.join(path, "README.md")
        if place(path) in files.src_uris:
            return f"{image}[{label}]({path}{'#' + anchor if anchor else ''})"
        if not (ROOT / place(path)).exists():
            log.warning("%s: the link '%s' leads nowhere", page.file.src_uri, link)
        return label

    def shows(match):
        file = ROOT / place(match[2])
        if file.suffix not in LANGUAGES or not file.is_file():
            return match[0]
        return f"```{LANGUAGES[file.suffix]} title=\"{match[1]}\"\n{file.read_text()}```\n"

    text = re.sub(r"(?m)^\[([^\]]+)\]\(([^)]+)\)\n(?=\n|\Z)", shows, text)
    parts = re.split(r"(?ms)(^ *```.*?^ *```$)", text)  # fenced blocks stay as they are
    for i in range(0, len(parts), 2):
        parts[i] = re.sub(r"(?m)^\|.*", lambda row: re.sub("`[^`]*`", lambda code: code[0].replace("\\|", "|"), row[0]), parts[i])
        # GitHub needs no empty line before a list, nor between a block and a table.
        parts[i] = re.sub(r"(?m)^(?! *(?:[-*]|\d+\.) |  |$|\||#)(.*\n)(?=(?:- |1\. ))", r"\1\n", LINK.sub(leads, parts[i]))
    return "\n".join(parts)


class Anchors(html.parser.HTMLParser):
    def __init__(self):
        super().__init__()
        self.ids, self.links = set(), set()

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        self.ids |= {attrs[k] for k in ("id", "name") if attrs.get(k)}
        self.links |= {attrs[k] for k in ("href", "src") if attrs.get(k)}


def on_post_page(output, page, config):
    found = Anchors()
    found.feed(output)
    seen[page.file.dest_uri] = found
    return output


def on_post_build(config):
    for page, found in seen.items():
        for link in found.links:
            url = urllib.parse.urlsplit(link)
            if url.scheme in ("http", "https", "mailto", "data"):
                continue
            path = posixpath.normpath(posixpath.join(posixpath.dirname(page), urllib.parse.unquote(url.path))) if url.path else page
            if not pathlib.Path(config.site_dir, path).exists():
                log.warning("%s: the link '%s' leads nowhere", page, link)
            elif url.fragment and path in seen and urllib.parse.unquote(url.fragment) not in seen[path].ids:
                log.warning("%s: the anchor of '%s' is missing", page, link)
