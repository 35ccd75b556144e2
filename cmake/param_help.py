#!/usr/bin/python3
"""Writes a C++ file with the meaning of a node's parameters: the comments at their declarations.

usage: param_help.py OUTPUT FOLDER [SHARED]   SHARED holds further headers with parameters (common/)
"""
import pathlib
import re
import sys


def comments_in(header):
    """(field, comment) of what a header declares: the comment behind the field, else the one above its group, which ends
    at an empty line."""
    statement, fields, behind, above, goes_on = "", [], "", "", False
    for line in header.read_text().splitlines():
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


def comments_of(folder, shared):
    """Field -> comment: of the headers of a node's folder, its parameters first, then of shared headers with parameters."""
    found = {}
    headers = sorted(folder.rglob("*.h"), key=lambda p: (not re.search(r"_(node|params)\.h$", p.name), len(p.parts), p.name))
    others = [p for p in sorted(shared.rglob("*.h")) if "void visit(" in p.read_text()] if shared else []
    for header in [*headers, *others]:
        for field, comment in comments_in(header):
            if re.sub(r"\[[^\]]*\]|[, ]", "", comment):  # more than units
                found.setdefault(field, comment)
    return found


def keys_of(folder, shared):
    """Last parts of all keys that visits name."""
    text = "".join(p.read_text() for top in (folder, shared) if top for p in sorted(top.rglob("*.[hc]*"))
                   if "visit(" in p.read_text())
    return set(re.findall(r'"(\w+)"', text))


def main():
    output, folder, *shared = map(pathlib.Path, sys.argv[1:])
    shared = shared[0] if shared else None
    keys = keys_of(folder, shared)
    lines = "".join(f"{field}\t{comment}\n" for field, comment in comments_of(folder, shared).items() if field in keys)
    output.write_text("// Made by cmake/param_help.py.\nnamespace mimesis::runtime {\nbool explain(const char* lines);\n"
                      "}\nnamespace {\n[[maybe_unused]] const bool kExplained =\n    mimesis::runtime::explain(R\"help(" +
                      lines + ')help");\n}  // namespace\n')


if __name__ == "__main__":
    main()
