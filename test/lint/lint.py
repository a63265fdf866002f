#!/usr/bin/env python3
"""Checks the tree against the rules of the house (rules.py): include arrows, code for targets, clocks and random numbers,
floating point, heap in the loop, folders, names of types and words. Prints `file:line: [rule] what` with what to do; exit 1 when something is found.

    test/lint/lint.py [--root DIR] [--compile-commands FILE]
"""

import argparse
import json
import re
import subprocess
import sys
from collections import namedtuple
from pathlib import Path, PurePosixPath

import rules

Finding = namedtuple("Finding", "path line rule what remedy")

IGNORED_FOLDERS = {".git", "build", "runs", "__pycache__"}


def list_files(root):
    """Files that are, or could be, committed; sorted, so that the report is the same everywhere."""
    if (root / ".git").exists():
        git = subprocess.run(["git", "-C", str(root), "ls-files", "-co", "--exclude-standard", "-z"], capture_output=True, check=False)
        if git.returncode == 0:
            names = git.stdout.decode().split("\0")
            return sorted(n for n in names if n and (root / n).is_file())
    found = []
    for path in root.rglob("*"):
        relative = path.relative_to(root)
        if path.is_file() and not IGNORED_FOLDERS & set(relative.parts):
            found.append(relative.as_posix())
    return sorted(found)


# Comments, raw strings, strings and characters; a quote inside a number (1'000) is no character.
_LEXICAL = re.compile(
    r"""(?P<comment>//[^\n]*|/\*.*?\*/)|(?P<raw>R"(?P<delimiter>[^()\\\s]{0,16})\(.*?\)(?P=delimiter)")"""
    r"""|(?P<string>"(?:\\.|[^"\\\n])*")|(?P<char>(?<![0-9A-Za-z_])'(?:\\.|[^'\\\n])+')""", re.DOTALL)


def _blank(text):
    return re.sub(r"[^\n]", " ", text)


def without_comments(text):
    return _LEXICAL.sub(lambda m: _blank(m.group()) if m.group("comment") else m.group(), text)


def without_comments_and_strings(text):
    return _LEXICAL.sub(lambda m: _blank(m.group()), text)


def line_of(text, offset):
    return text.count("\n", 0, offset) + 1


# Ends of the text before a body's brace: parameters, with what may follow them, a constructor's list of members, a lambda's capture.
_FUNCTION_END = re.compile(r"(?:\)(?:\s*(?:const|noexcept|override|final|mutable|constexpr|requires|&&?|->[\w:&*\s]+))*|\]|\}|\btry)\s*$")


def _function_name(head):
    """Name of the function whose body follows `head`, "lambda", or None where no function's body does."""
    while True:
        plain = re.sub(r"<[^<>()]*(?:\([^()]*\)[^<>()]*)*>|\[\[[^\]]*\]\]|\balignas\s*\([^()]*\)", " ", head)
        if plain == head:
            break
        head = plain
    if not _FUNCTION_END.search(head) or re.search(r"\brequires\s*\([^()]*\)\s*$", head):
        return None
    if re.search(r"\[[^\[\]]*\]\s*(?:\([^()]*(?:\([^()]*\)[^()]*)*\)[^()]*)?$", head) and "operator" not in head:
        return "lambda"
    named = re.search(r"(operator\s*(?:\(\)|[^\s\w(]+|[\w:\s&*]+)|[\w:~]+)\s*\(", head)
    return named.group(1).strip() if named and head.count("(") == head.count(")") else None


def functions(text):
    """[(name, first line, last line)] of the functions of a source; a lambda inside a function counts with it. Braces are matched, so
    the layout does not matter."""
    text = without_comments_and_strings(text)
    text = re.sub(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", lambda m: _blank(m.group()), text, flags=re.MULTILINE)
    found, begin, depth, body, lists = [], 0, 0, None, []
    for match in re.finditer(r"[{};]", text):
        at, sign = match.start(), match.group()
        depth += {"{": 1, "}": -1, ";": 0}[sign]
        if body:  # (name, start, depth of its braces)
            if sign == "}" and depth == body[2] - 1:
                found.append((body[0], line_of(text, body[1]), line_of(text, at)))
                body, begin = None, at + 1
            continue
        head = text[begin:at]
        if sign == "{":
            name = _function_name(head)
            if name:
                body = (name, begin + len(head) - len(head.lstrip()), depth)
                continue
            # A default argument or a member of a constructor's list: the head goes on behind it.
            if head.count("(") > head.count(")") or re.search(r"\)\s*(?:noexcept\s*)?:[^:].*[\w>]\s*$", head, re.DOTALL):
                lists.append(depth)
                continue
        if lists:
            if sign == "}" and depth == lists[-1] - 1:
                lists.pop()
            continue
        begin = at + 1
    return found


def inside(path, folder):
    """`path` is `folder`, or lies in it."""
    return path == folder or path.startswith(folder.rstrip("/") + "/")


def room_of(path):
    matching = [room for room in rules.ARROWS if inside(path, room)]
    return max(matching, key=len) if matching else None


def read_tree(root):
    """{path: text} of the tree; binary files have the text None."""
    tree = {}
    for name in list_files(root):
        data = (root / name).read_bytes()
        tree[name] = None if b"\0" in data[:8192] else data.decode("utf-8", errors="replace")
    return tree


class Linter:
    def __init__(self, tree):
        self.files = set(tree)
        self.findings = []
        self.text = {name: text for name, text in tree.items() if text is not None}
        self.sources = [f for f in self.text if f.endswith(rules.SOURCE_SUFFIXES)]

    def report(self, path, line, rule, what, remedy):
        self.findings.append(Finding(path, line, rule, what, remedy))

    def run(self, compile_commands=()):
        includes = self.read_includes()
        self.check_arrows(includes)
        self.check_reach(includes)
        self.check_target_headers()
        self.check_tokens()
        self.check_build_options(compile_commands)
        self.check_folders()
        self.check_function_lengths()
        self.check_type_names()
        self.check_leaks()
        return sorted(set(self.findings))

    # (a)
    def read_includes(self):
        """source -> [(line, included path)], quoted includes only."""
        includes = {}
        for source in self.sources:
            text = without_comments(self.text[source])
            includes[source] = []
            for match in re.finditer(r'^[ \t]*#[ \t]*include[ \t]*"([^"]+)"', text, re.MULTILINE):
                target, line = match.group(1), line_of(text, match.start(1))
                if target in self.files:
                    includes[source].append((line, target))
                elif target not in rules.GENERATED_HEADERS:
                    self.report(source, line, "include-path", f'"{target}" is no file of this repository',
                                "write the path from the repository's root; system and third-party headers in <>")
        return includes

    def check_arrows(self, includes):
        for source, targets in includes.items():
            room = room_of(source)
            if room is None:
                self.report(source, 1, "include-arrow", "this folder has no row in the table of include arrows",
                            "say in test/lint/rules.py, ARROWS, what the room stands on")
                continue
            allowed = [room] + rules.ARROWS[room]
            for line, target in targets:
                if not any(inside(target, a) for a in allowed):
                    self.report(source, line, "include-arrow", f"{room} may not include {target}",
                                f"allowed: {', '.join(allowed)}; move the shared part down, or pass it in as data")

    def check_reach(self, includes):
        for folder, exempt, banned, why in rules.NEVER_REACHES:
            for source in self.sources:
                if not inside(source, folder) or any(inside(source, e) for e in exempt):
                    continue
                for line, chain in self.reach(source, includes, banned):
                    self.report(source, line, "include-reach", f"{folder} reaches {chain[-1]}: {' -> '.join(chain)}",
                                f"cut the chain: {why}")

    @staticmethod
    def reach(source, includes, banned):
        """For each direct include of `source`: the shortest chain to a banned file, if there is one."""
        found = []
        for line, first in includes.get(source, []):
            seen, queue = {first}, [[source, first]]
            while queue:
                chain = queue.pop(0)
                if any(inside(chain[-1], b) for b in banned):
                    found.append((line, chain))
                    break
                for _, target in includes.get(chain[-1], []):
                    if target not in seen:
                        seen.add(target)
                        queue.append(chain + [target])
        return found

    # (b)
    def check_target_headers(self):
        for source in self.sources:
            if not any(inside(source, room) for room in rules.TARGET_ROOMS):
                continue
            text = without_comments(self.text[source])
            for match in re.finditer(r"^[ \t]*#[ \t]*include[ \t]*<([^>]+)>", text, re.MULTILINE):
                if match.group(1) not in rules.TARGET_HEADERS:
                    self.report(source, line_of(text, match.start(1)), "target-header", f"<{match.group(1)}> in code for a target",
                                "allowed: " + " ".join(sorted(rules.TARGET_HEADERS)))

    # (b) to (f)
    def check_tokens(self):
        code = {source: without_comments_and_strings(self.text[source]) for source in self.sources}
        # A pragma's or attribute's argument may be a string: that rule looks at text with strings.
        for rule in rules.TOKEN_RULES:
            pattern = re.compile(rule.pattern)
            for source in self.sources:
                if not any(inside(source, folder) for folder in rule.where):
                    continue
                text = without_comments(self.text[source]) if '\\"' in rule.pattern else code[source]
                matches = list(pattern.finditer(text))
                if source in rule.except_files:
                    if not matches:
                        self.report(source, 1, "exemption-not-needed", f"the exemption from {rule.id} suppresses nothing",
                                    "remove it from test/lint/rules.py")
                    continue
                for match in matches:
                    found = re.sub(r"\s+", " ", match.group()).rstrip("( ")
                    self.report(source, line_of(text, match.start()), rule.id, rule.what.format(found), rule.remedy)

    # (e)
    def check_build_options(self, compile_commands):
        path, option = rules.REQUIRED_OPTION
        if option not in re.sub(r"#[^\n]*", "", self.text.get(path, "")):
            self.report(path, 1, "float-option", f"{option} is not among the options of every target", f"add it to {path}: runs are compared bit by bit")
        for name, text in self.text.items():
            is_build_file = any(name.endswith(b) or (b.endswith("/") and name.startswith(b)) for b in rules.BUILD_FILES)
            if not is_build_file:
                continue
            plain = text if name.endswith(".json") else re.sub(r"#[^\n]*", lambda m: _blank(m.group()), text)
            for match in re.finditer(rules.FORBIDDEN_OPTIONS, plain):
                self.report(name, line_of(plain, match.start()), "float-option", f"{match.group()} lets results depend on the CPU or the compiler",
                            "remove it: runs are compared bit by bit, on any machine")
        for entry in compile_commands:
            command = entry.get("command") or " ".join(entry.get("arguments", []))
            if option not in command.split():
                self.report(entry["file"], 1, "float-option", f"compiled without {option}",
                            "link its target with rl_options (rl_library and rl_test do)")

    # (g)
    def check_folders(self):
        with_sources = sorted({str(PurePosixPath(s).parent) for s in self.sources})
        for folder in with_sources:
            if any(inside(folder, e) for e in rules.README_NOT_NEEDED_BELOW) or folder == ".":
                continue
            if f"{folder}/README.md" not in self.files:
                self.report(f"{folder}/README.md", 1, "folder-readme", "this folder has sources and no README.md",
                            "ten lines: what goes in and out, where to start, what never enters, what checks it")
        for name in self.text:
            if name.endswith(rules.SOURCE_SUFFIXES + rules.SCRIPT_SUFFIXES):
                lines = self.text[name].count("\n")
                if lines > rules.MAX_LINES:
                    self.report(name, rules.MAX_LINES + 1, "file-length", f"{lines} lines, the limit is {rules.MAX_LINES}", "split it: one idea per file")

    def check_function_lengths(self):
        unused = dict(rules.LONG_FUNCTIONS)
        for name in self.sources:
            if inside(name, "test"):
                continue
            for function, first, last in functions(self.text[name]):
                lines, listed = last - first + 1, unused.pop(f"{name}: {function}", None) if last - first >= rules.MAX_FUNCTION_LINES else None
                limit = rules.HARD_MAX_FUNCTION_LINES if listed else rules.MAX_FUNCTION_LINES
                if lines > limit:
                    self.report(name, first, "function-length", f"{function} has {lines} lines, the limit is {limit}",
                                "split it into steps that have names of their own")
        for path, function in (entry.split(": ") for entry in unused):
            if path in self.files:
                self.report(path, 1, "exemption-not-needed", f"{function} needs no exemption from function-length",
                            "remove it from LONG_FUNCTIONS in test/lint/rules.py")

    # (h) The linker takes one of two types of a name for both, and the program ends somewhere else than where the mistake is.
    def check_type_names(self):
        seen = {}
        for header in sorted(s for s in self.sources if s.endswith((".hpp", ".h")) and not inside(s, "test")):
            text = without_comments_and_strings(self.text[header])
            space = ""
            for match in re.finditer(r"^(?:namespace\s+([\w:]*)\s*\{|(?:struct|class|enum class|enum)\s+(\w+)(?:\s+final)?\s*(?::(?!:)[^;{]*)?\{)", text, re.MULTILINE):
                if match.group(2) is None:
                    space = match.group(1)
                    continue
                name = f"{space}::{match.group(2)}"
                if name in seen and space:
                    self.report(header, line_of(text, match.start()), "type-name", f"{name} is defined in {seen[name]} too",
                                "give each its own name: the linker would take one for both")
                seen.setdefault(name, header)

    # (i)
    def check_leaks(self):
        for rule, pattern, what, remedy in rules.LEAKS:
            compiled = re.compile(pattern)
            for name, text in self.text.items():
                if name in rules.LEAK_EXEMPT:
                    continue
                for match in compiled.finditer(text):
                    self.report(name, line_of(text, match.start()), rule, what.format(match.group()), remedy)


def main(arguments):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--root", default=Path(__file__).resolve().parents[2], type=Path)
    parser.add_argument("--compile-commands", default=None, type=Path, help="compile_commands.json: check the options of every compiled file")
    options = parser.parse_args(arguments)
    commands = json.loads(options.compile_commands.read_text(encoding="utf-8")) if options.compile_commands else []
    linter = Linter(read_tree(options.root))
    findings = linter.run(commands)
    for f in findings:
        print(f"{f.path}:{f.line}: [{f.rule}] {f.what}\n  do: {f.remedy}")
    print(f"lint: {len(linter.files)} files, {len(findings)} findings", file=sys.stderr)
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
