"""Pages of the API: one a folder of common/, from the comments in its headers, as Doxygen reads them.

What Doxygen warns about, and a class or function that nothing is said of, is a warning, which `strict` makes an error.
"""
import collections
import pathlib
import re
import subprocess
import tempfile
import xml.etree.ElementTree as xml

# Of common/runtime what nodes and tools include; the other headers there are its own parts.
RUNTIME = {f"common/runtime/{name}.h" for name in "bus job log own_topics params ports raw run_node yaml_document zmq_bus".split()}
INDEX = """# API

Headers that `libmimesis-dev` installs, by the folder of `common/` that holds them. A node needs [runtime](runtime.md) and, in its tests,
[testing](testing.md). `find_package(Mimesis COMPONENTS log)` gives the library `Mimesis::log`; that of runtime is `Mimesis::node`.
Messages are described in their [.proto files](../proto/README.md).

"""
SETTINGS = """
INPUT = common
FILE_PATTERNS = *.h
RECURSIVE = YES
EXCLUDE_PATTERNS = */test/* */bench/* */fuzz/*
STRIP_FROM_PATH = {root}
OUTPUT_DIRECTORY = {out}
GENERATE_HTML = NO
GENERATE_LATEX = NO
GENERATE_XML = YES
XML_PROGRAMLISTING = NO
HIDE_UNDOC_RELATIONS = YES
WARN_IF_UNDOCUMENTED = NO
WARN_IF_INCOMPLETE_DOC = NO
QUIET = YES
"""


def words(element):
    """A description as Markdown."""
    if element is None:
        return ""
    text = element.text or ""
    for part in element:
        inner = words(part)
        if part.tag == "computeroutput":
            inner = f"`{inner}`"
        elif part.tag in ("verbatim", "programlisting"):
            inner = f"\n```\n{inner.strip()}\n```\n"
        elif part.tag in ("para", "itemizedlist", "orderedlist"):
            inner = f"{inner.strip()}\n\n"
        elif part.tag == "listitem":
            inner = f"\n- {inner.strip()}"
        elif part.tag == "parameteritem":
            names = ", ".join(f"`{''.join(n.itertext()).strip()}`" for n in part.iter("parametername"))
            thrown = "throws " if element.get("kind") == "exception" else ""
            inner = f"\n- {thrown}{names}: {words(part.find('parameterdescription')).strip()}"
        elif part.tag == "simplesect" and part.get("kind") == "return":
            inner = f"\n- returns {inner.strip()}"
        elif part.tag in ("sp", "ndash", "mdash"):
            inner = {"sp": " ", "ndash": "--", "mdash": "---"}[part.tag]
        text += inner + (part.tail or "")
    return text


def said(element):
    both = words(element.find("briefdescription")) + words(element.find("detaileddescription"))
    return re.sub(r"\n\s*\n+", "\n\n", both).strip()


def plain(element):
    return re.sub(r"\s+", " ", "".join(element.itertext())) if element is not None else ""


def signature(member):
    """A member as it is declared."""
    return re.sub(r"(?<=<) | (?=>)", "", declared(member))


def declared(member):
    kind, name, of = member.get("kind"), member.findtext("name"), plain(member.find("type"))
    parameters = ", ".join(plain(p.find("type")) + (f" {p.findtext('declname')}" if p.findtext("declname") else "")
                           for p in member.findall("templateparamlist/param"))
    head = f"template <{parameters}> " if parameters else ""
    value = f" {plain(member.find('initializer'))}" if member.find("initializer") is not None else ""
    if kind == "function":
        arguments = re.sub(r"\s*=\s*0$", "", member.findtext("argsstring") or "")
        return f"{head}{'static ' if member.get('static') == 'yes' else ''}{of}{' ' if of else ''}{name}{arguments}"
    if kind == "enum":
        return f"enum {name}"
    if kind == "typedef":
        return f"using {name} = {of}"
    return f"{of} {name}{value if len(value) < 60 else ''}{member.findtext('argsstring') or ''}"


def item(member, indent=""):
    """A member of a list, with its meaning behind it."""
    name = f"`{signature(member)}`" if member.tag == "memberdef" else f"`{member.findtext('name')}`"
    text = f"{indent}- {name}" + (f": {said(member)}" if said(member) else "")
    return "\n".join([text.replace("\n", f"\n{indent}    "), *(item(v, indent + "    ") for v in member.findall("enumvalue"))])


def public(compound):
    return [m for s in compound.findall("sectiondef") for m in s.findall("memberdef")
            if m.get("prot") == "public" and m.get("kind") != "friend"
            and not re.search(r"= *(delete|default)$", m.findtext("argsstring") or "")]


def pages(root, warn):
    """Text of every page by its name. `warn` takes a line for each thing that is wrong."""
    with tempfile.TemporaryDirectory() as out:
        done = subprocess.run(["doxygen", "-"], input=SETTINGS.format(root=root, out=out), cwd=root, capture_output=True, text=True, check=True)
        for line in done.stderr.splitlines():
            warn(line.removeprefix(f"{root}/"))
        compounds = [xml.parse(p).getroot().find("compounddef") for p in sorted(pathlib.Path(out, "xml").glob("*.xml"))
                     if p.name.startswith(("class", "struct", "namespace"))]
    headers = collections.defaultdict(list)  # file -> (is a class, line, text): what is in no class comes first

    def add(element, name, text, is_said):
        file, line = element.find("location").get("file"), int(element.find("location").get("line"))
        if file.startswith("common/runtime/") and file not in RUNTIME:
            return
        headers[file].append((text.startswith("###"), line, text + "\n"))
        lines = (root / file).read_text().split("\n")
        first = max((n for n in range(line) if not lines[n].strip()), default=-1)
        last = next(n for n in range(line, len(lines)) if not lines[n].strip())
        if not is_said and not any("///" in text for text in lines[first + 1:last]):  # one comment may be of several declarations
            warn(f"{file}:{line}: nothing is said of {name}")

    for compound in compounds:
        members, name = public(compound), compound.findtext("compoundname").removeprefix("mimesis::")
        if compound.get("kind") == "namespace":
            for member in members:
                add(member, member.findtext("name"), item(member), member.get("kind") != "function" or said(member))
        elif compound.get("prot") == "public" and "<" not in name:
            bases = ", ".join(plain(b) for b in compound.findall("basecompoundref") if b.get("prot") == "public")
            text = f"### {name}\n\n" + (f"`{compound.get('kind')} {name.split('::')[-1]} : {bases}`\n\n" if bases else "")
            add(compound, name, f"{text}{said(compound)}\n\n" + "\n".join(item(m) for m in members), said(compound))
    found = collections.defaultdict(str)
    for header in sorted(headers):
        folder = "_".join(header.split("/")[1:-1]) or "common"
        found[folder] += f"## {header}\n\n" + "\n".join(text for *_, text in sorted(headers[header])) + "\n"
    made = {name: f"# {name}\n\n{text}" for name, text in found.items()}
    made["index"] = INDEX + "".join(f"- [{name}]({name}.md): {', '.join(re.findall(r'(?m)^## .*/(.*)', found[name]))}\n" for name in sorted(found))
    return made
