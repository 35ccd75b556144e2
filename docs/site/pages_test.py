#!/usr/bin/env python3
"""Tries what the pages show: pages_test.py BUILD_DIR [PAGE ...]

- ```sh and ```console blocks of a page run one after the other in one shell, in a copy of parts of the tree, with the built programs
  in PATH. `# exit code N` behind a command: it ends so. A console block holds `$ COMMAND` and what it prints: numbers,
  paths of logs and white space may differ, `...` is any text.
- Blocks behind a comment `<!-- not run: REASON -->`, and those of NOT_RUN, are only checked: programs, verbs, options, parameters,
  launch files with their arguments, targets, presets, groups and tests have to be there.
- YAML that begins with `version:` is a launch file, with `name:` a scenario of the crowd: both are checked. Python has to compile.
"""
import concurrent.futures
import functools
import json
import os
import pathlib
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import pages

ROOT = pages.ROOT
NOT_RUN = {"docs/deploy.md": "needs root and systemd", "docs/hosts.md": "needs several hosts"}
EXAMPLES = {f"mimesis_{p.stem}" for p in (ROOT / "docs/examples").glob("*/*.cc")} | {"build/log_reader", "mimesis_negative"}  # install_test.py
FOREIGN = {*EXAMPLES, *"apt candump cd cp cpack ctest eval export ip journalctl kill mkdir protoc python3 systemctl wait".split()}
SHELL = re.compile(r"(tools/|tests/|build/|mimesis|cmake|sudo |export |\()")
PAGE_S = 120  # longest run of a page: some ten times what it takes on an idle machine


def blocks(page):
    """(line, language, text, is run) of every fenced block, and of indented ones that hold commands."""
    lines, reason, i = (ROOT / page).read_text().split("\n"), None, 0
    while i < len(lines):
        fence = re.match(r"( *)```(\w*)", lines[i])
        indented = not fence and SHELL.match(lines[i].removeprefix("    ")) and lines[i].startswith("    ") and not lines[i - 1].strip()
        start, found = i + 1, []
        if fence:
            while not lines[i + 1].strip() == "```":
                i += 1
                found.append(lines[i].removeprefix(fence[1]))
            i += 1
        elif indented:
            while lines[i].startswith("    "):
                found.append(lines[i][4:])
                i += 1
        if found:
            text = "\n".join(found)
            prompted = re.match(r"\w*\$ ", text)
            yield start, (fence and fence[2]) or ("console" if prompted else "" if fence else "sh"), text, not reason and page not in NOT_RUN
        if lines[i].strip():
            marked = re.search(r"<!-- not run: (.*) -->", lines[i])
            reason = marked and marked[1]
        i += 1


def prompts(text):
    """(command, output) pairs of a console block."""
    parts = re.split(r"(?m)^\w*\$ (.*)\n?", text)
    return list(zip(parts[1::2], parts[2::2]))


@functools.lru_cache(maxsize=None)
def say(*command, cwd=None):
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=cwd, timeout=60,
                          env=dict(ENVIRONMENT, PATH=f"{CHECKED}/build/bin:{ENVIRONMENT['PATH']}") if cwd == CHECKED else ENVIRONMENT)
    return done.returncode, done.stdout + done.stderr


def check(argv):
    """What is wrong with a command; empty if nothing is."""
    while argv and (re.match(r"\w+=", argv[0]) or argv[0] in ("sudo", "env", "ssh")):
        skipped = {"sudo": 2 if argv[1:2] == ["-u"] else 0, "ssh": 1}.get(argv[0], 0)
        argv = argv[1 + skipped:]
    if not argv:
        return ""
    program, arguments = argv[0].removeprefix("build/bin/"), argv[1:]
    options = [re.match(r"-[^=]*", a)[0] for a in arguments if re.match(r"--?[a-zA-Z]", a)]
    if program == "tools/demo":
        code, said = say("tools/demo", *arguments, cwd=CHECKED)
        return said if code != 0 else ""
    if re.match(r"mimesis_\w+$", program) and (BIN / program).exists() and "--help" not in options:
        code, said = say(BIN / program, *arguments, "--check")
        return said if code != 0 else ""
    if program == "mimesis" and arguments[0] == "launch" and (ROOT / arguments[1]).is_file():
        code, said = say(BIN / program, *arguments, "--dry-run", cwd=ROOT)
        return said if code != 0 else ""
    if program.startswith("mimesis") and program not in EXAMPLES:
        words = [a for a in arguments if not a.startswith("-")] if program == "mimesis" else []
        code, text = say(BIN / program, *words[:1], "--help")
        if code != 0:
            return f"there is no verb {words[0]}"
        if "SUBCOMMAND" in text and len(words) > 1:
            inner = say(BIN / program, *words[:2], "--help")[1]
            if inner == text:
                return f"{words[0]} has no {words[1]}"
            text = text + inner if words[0] == "launch" else inner  # it takes a file as well as a verb
        if words[:1] == ["reproduce"]:
            listed = say(BIN / program, "reproduce", "--list")[1]
            unknown = [w for w in words[1:] if re.match(r"(fig|table)-", w) and w not in listed]
            if unknown:
                return f"there is no figure {unknown}"
    elif program in FOREIGN or program.startswith(("ninja", "build-fuzz/")):
        return ""
    elif program == "cmake":
        if "--build" in arguments and "--target" in arguments:
            for target in arguments[arguments.index("--target") + 1:]:
                if say("ninja", "-C", BUILD, "-t", "query", target)[0] != 0:
                    return f"there is no target {target}"
        presets = [p["name"] for p in json.loads((ROOT / "CMakePresets.json").read_text())["configurePresets"]]
        if "--preset" in arguments and arguments[arguments.index("--preset") + 1] not in presets:
            return f"there is no such preset: {arguments}"
        return ""
    elif program == "tools/setup":
        groups = {line.split()[0] for line in (ROOT / "tools/packages.txt").read_text().split("\n") if line}
        return "" if groups.issuperset(arguments) else f"no such group of packages: {arguments}"
    elif (ROOT / program).is_file():
        text = (ROOT / program).read_text()
    else:
        return "there is no such program"
    known = set(re.findall(r"(?<![\w-])--?[a-zA-Z][\w-]*", text))
    return "".join(f"it has no option {o}; " for o in options if o not in known)


def commands(text):
    """Words of all simple commands in shell text, those within $(...) too."""
    text = re.sub(r"(?m)(^|\s)#.*$", "", text)
    for inner in re.findall(r"\$\(([^()]*)\)", text):
        yield from commands(inner)
    lexer = shlex.shlex(re.sub(r"\\\n", " ", re.sub(r"\$\([^()]*\)", "INNER", text)), posix=True, punctuation_chars="();<>|&\n")
    lexer.whitespace, lexer.whitespace_split = " \t", True
    words = []
    for token in [*lexer, "\n"]:
        if token.strip("();|&\n"):
            words.append(token)
        elif words:
            yield words[:words.index(">")] if ">" in words else words
            words = []


def script(page):
    """The shell text of a page, and what its commands shall print, by the names of files."""
    lines, expected = ["set -euo pipefail"], {}
    for at, language, text, run in blocks(page):
        if not run or language not in ("sh", "console"):
            continue
        COUNTS["run"] += sum(1 for _ in commands(text if language == "sh" else "\n".join(c for c, _ in prompts(text))))
        lines.append(f"echo '{page}:{at}' >~/@at")
        if language == "sh":
            lines.append(re.sub(r"(?m)^(.*?) +# exit code (\d+).*$", r"{ \1; } && false || [ $? = \2 ]", text))
        for n, (command, output) in enumerate(prompts(text) if language == "console" else []):
            expected[f"@{at}.{n}"] = output
            lines.append(f"{{ {command}\n}} >~/@{at}.{n} 2>&1")
    return "\n".join(lines) + "\n", expected


def pattern(shown):
    """A regular expression for the output that a page shows."""
    def plain(text):
        text = re.sub(r"/[\w./-]*/log/[\w-]+", "LOG", text)
        return re.sub(r"-?\d+(\.\d+)?(e[+-]?\d+)?", "#", re.sub(r"\s+", "", text))
    return plain, re.compile(".*".join(re.escape(part) for part in plain(shown).split("...")), re.DOTALL)


def tree(folder, launcher):
    """A copy of the parts of the source tree that pages use, where set-up and building do nothing and `mimesis launch` is `launcher`."""
    (folder / "build" / "bin").mkdir(parents=True)
    for part in ("docs", "launch", "models", "proto", "python", "tests/replay", "tools"):  # copies, as commands write into them
        shutil.copytree(ROOT / part, folder / part)
    for program in BIN.glob("mimesis*"):
        if program.name != "mimesis":
            (folder / "build/bin" / program.name).symlink_to(program)
    for path, text in (("build/bin/mimesis", launcher), ("tools/setup", "exit 0"), ("build/bin/cmake", "exit 0")):
        (folder / path).unlink(missing_ok=True)
        (folder / path).write_text(f"#!/bin/bash\n{text}\n")
        (folder / path).chmod(0o755)
    (folder / "build/generated").symlink_to(BUILD / "generated")
    (folder / "build/bin/python3").symlink_to(sys.executable)
    return folder


class Pages(unittest.TestCase):
    def test_options_exist(self):
        for page in CHOSEN:
            for at, language, text, run in blocks(page):
                if language not in ("sh", "console"):
                    continue
                shell = text if language == "sh" else "\n".join(command for command, _ in prompts(text))
                for argv in commands(shell):
                    if not run:
                        COUNTS["checked"] += 1
                    with self.subTest(f"{page}:{at}: {' '.join(argv)}"):
                        self.assertEqual(check(argv), "")
                COUNTS["blocks not run"] += not run

    def test_mistakes_are_found(self):
        for wrong in ("mimesis topic lost", "mimesis tup", "mimesis log clean --keeep 1", "mimesis_camera --set nois=1", "tools/setup kore",
                      "tools/demo --teecher full", "cmake --build build --target programmes", "cmake --preset fast", "mimesys top"):
            self.assertNotEqual(check(wrong.split()), "", wrong)
        plain, wanted = pattern("placed after 3.2 s ...\nok")
        self.assertTrue(wanted.fullmatch(plain("placed after 14 s\nmore\nok\n")))
        self.assertFalse(wanted.fullmatch(plain("placed after 14 s\nmore\nnot o.k.\n")))

    def test_commands_run(self):
        with concurrent.futures.ThreadPoolExecutor(2) as two:
            tried = {page: two.submit(self.run_page, page, *script(page)) for page in CHOSEN}
        for page, trial in tried.items():
            with self.subTest(page):
                if trial.exception():  # once more, alone: on the wall clock a bridge stops if the machine lets it wait
                    print(f"{page}: {trial.exception()}", file=sys.stderr)
                    self.run_page(page, *script(page), again="-again")

    def run_page(self, page, text, expected, again=""):
        if text.count("\n") == 1:
            return
        folder = tree(WORK / (page.replace("/", "_") + again), f'exec "{BIN}/mimesis" "$@"')
        environment = dict(ENVIRONMENT, HOME=str(folder), MIMESIS_GRAPH=f"page-{CHOSEN.index(page)}", PATH=f"{folder}/build/bin:{os.environ['PATH']}")
        begin = time.monotonic()
        with open(folder / "@said", "w", encoding="utf-8") as said:
            shell = subprocess.Popen(["bash", "-c", text], cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=said, stderr=said,
                                     start_new_session=True)
            try:
                code = shell.wait(PAGE_S)
            except subprocess.TimeoutExpired:
                code = f"none after {PAGE_S} s"
            try:
                os.killpg(shell.pid, signal.SIGTERM)
            except ProcessLookupError:
                pass
            shell.wait()
        print(f"{page}: {time.monotonic() - begin:.1f} s", file=sys.stderr)
        self.assertEqual(code, 0, f"{(folder / '@at').read_text()}{(folder / '@said').read_text()[-3000:]}")
        for name, shown in expected.items():
            plain, wanted = pattern(shown)
            printed = (folder / name).read_text()
            self.assertTrue(wanted.fullmatch(plain(printed)), f"{page}:{name[1:]}: shown:\n{shown}\nprinted:\n{printed}")

    def test_whole_files(self):
        for page in CHOSEN:
            for at, language, text, _ in blocks(page):
                with self.subTest(f"{page}:{at}"):
                    if language == "python":
                        compile(text, page, "exec")
                    if language == "yaml" and re.match("version:|name:", text):
                        file = WORK / "page.yaml"
                        file.write_text(text)
                        verb = ["crowd", "certify"] if text.startswith("name:") else ["launch"]
                        option = [] if text.startswith("name:") else ["--dry-run" if "hosts:" in text else "--check"]
                        code, said = say(BIN / "mimesis", *verb, file, *option)
                        self.assertEqual(code, 0, said)


if __name__ == "__main__":
    BUILD = pathlib.Path(sys.argv[1]).resolve()
    BIN = BUILD / "bin"
    CHOSEN = sys.argv[2:] or pages.pages()
    COUNTS = {"run": 0, "checked": 0, "blocks not run": 0}
    with tempfile.TemporaryDirectory(prefix="pages-") as scratch:
        WORK = pathlib.Path(scratch)
        (WORK / "run").mkdir()
        ENVIRONMENT = dict(os.environ, XDG_RUNTIME_DIR=str(WORK / "run"), MIMESIS_GRAPH="pages", NO_COLOR="1", HOME=scratch)
        ENVIRONMENT.pop("XDG_STATE_HOME", None)
        CHECKED = tree(WORK / "checked", f'exec "{BIN}/mimesis" "$@" --dry-run')
        result = unittest.main(argv=sys.argv[:1], exit=False).result
        print(COUNTS, file=sys.stderr)
    sys.exit(not result.wasSuccessful())
