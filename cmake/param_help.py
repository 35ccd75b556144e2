#!/usr/bin/python3
"""Writes a C++ file with the meaning of a node's parameters: the comments at their declarations.

usage: param_help.py OUTPUT MAIN ROOT ...   Reads MAIN and what it includes with quotes, from the folder of the file that includes it
or from a ROOT, and the .cc beside each header; nothing else. OUTPUT.d names these files, for the build.
"""
import pathlib
import re
import sys


def comments_in(text):
    """(field, comment) of what a file declares: the comment behind the field, else the one above its group, which ends
    at an empty line."""
    statement, fields, behind, above, goes_on = "", [], "", "", False
    for line in text.splitlines():
        code, _, comment = line.partition("//")
        code, words = code.strip(), comment.lstrip("/<").strip()
        if not code and comment.startswith("/<"):
            behind += " " + words
            continue
        yield from ((field, behind.strip() or above) for field in fields)
        fields = []
        if not code:
            above = f"{above} {words}".strip() if goes_on or not comment else words
            above = above if comment else ""
            goes_on = bool(comment)
            continue
        goes_on = False
        statement, behind = f"{statement} {code}", words if comment.startswith("/<") else ""
        if code.endswith(";"):
            flat = re.sub(r"\{[^{}]*\}|\([^()]*\)|<[^<>]*>", "", statement)
            fields = re.findall(r"[\s*&](\w+)\s*(?:=[^,;]*)?(?=[,;])", flat)
        if code.endswith((";", "}", ":")) or re.search(r"[^\w]\{$|^\w+ \w+\{$", code):
            above = "" if code.endswith(("{", "}", ":")) else above
            statement = ""


def sources_of(main, roots):
    """Path -> text of every file that takes part; a byte that is no UTF-8 becomes U+FFFD."""
    texts, todo = {}, [main]
    while todo:
        file = todo.pop()
        if file in texts or not file.is_file():
            continue
        texts[file] = file.read_text(encoding="utf-8", errors="replace")
        for name in re.findall(r'(?m)^\s*#\s*include\s+"([^"]+)"', texts[file]):
            found = next((p for p in (folder / name for folder in (file.parent, *roots)) if p.is_file()), None)
            if found:
                todo += [found, found.with_suffix(".cc")]
    return texts


def comments_of(texts, folder):
    """Field -> comment: of the files in a node's folder, its parameters first, then of others that have parameters."""
    def rank(path):
        own = path.is_relative_to(folder)
        return not own, not (own and re.search(r"_(node|params)\.h$", path.name)), len(path.parts) if own else 0, str(path)

    found = {}
    for path in sorted(texts, key=rank):
        if path.is_relative_to(folder) or "void visit(" in texts[path]:
            for field, comment in comments_in(texts[path]):
                if re.sub(r"\[[^\]]*\]|[, ]", "", comment):  # more than units
                    found.setdefault(field, comment)
    return found


def main():
    output, start, *roots = map(pathlib.Path, sys.argv[1:])
    texts = sources_of(start, roots)
    keys = set(re.findall(r'"(\w+)"', "".join(text for text in texts.values() if "visit(" in text)))
    declared = {p: text for p, text in texts.items() if p.suffix == ".h" or p == start}
    lines = "".join(f"{field}\t{comment}\n" for field, comment in comments_of(declared, start.parent).items() if field in keys)
    output.parent.mkdir(exist_ok=True)
    output.write_text("// Made by cmake/param_help.py.\nnamespace mimesis::runtime {\nbool explain(const char* lines);\n"
                      "}\nnamespace {\n[[maybe_unused]] const bool kExplained =\n    mimesis::runtime::explain(R\"help(" +
                      lines + ')help");\n}  // namespace\n', encoding="utf-8")
    names = " ".join(re.sub(r"([ #\\])", r"\\\1", str(p)).replace("$", "$$") for p in [output, *texts])
    pathlib.Path(f"{output}.d").write_text(names.replace(" ", ": ", 1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
