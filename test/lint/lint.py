#!/usr/bin/env python3
"""Checks the tree against the rules of the house (rules.py): include arrows, code for targets, clocks and random numbers,
floating point, heap in the loop, loops of modules, size of folders and rooms, names of types, words, and the page that describes the house. Prints `file:line: [rule] what` with what to do; exit 1 when something is found.

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
from statements import joined_statements

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


def module_of(path):
    return path.rsplit(".", 1)[0]


def shortest_loop(start, steps):
    """The modules of the shortest way from `start` back to itself; empty when there is none."""
    came_from, queue = {start: None}, [start]
    while queue:
        at = queue.pop(0)
        for target in sorted(steps.get(at, {})):
            if target == start:
                chain = [at]
                while came_from[chain[0]] is not None:
                    chain.insert(0, came_from[chain[0]])
                return chain
            if target not in came_from:
                came_from[target] = at
                queue.append(target)
    return []


class Linter:
    def __init__(self, tree):
        self.files = set(tree)
        self.findings = []
        self.text = {name: text for name, text in tree.items() if text is not None}
        self.sources = [f for f in self.text if f.endswith(rules.SOURCE_SUFFIXES) and not inside(f, rules.VENDORED)]

    def report(self, path, line, rule, what, remedy):
        self.findings.append(Finding(path, line, rule, what, remedy))

    def run(self, compile_commands=()):
        includes = self.read_includes()
        self.check_arrows(includes)
        self.check_reach(includes)
        self.check_module_loops(includes)
        self.check_target_headers()
        self.check_tokens()
        self.check_build_options(compile_commands)
        self.check_folders()
        self.check_function_lengths()
        self.check_statements()
        self.check_room_sizes()
        self.check_house_page()
        self.check_type_names()
        self.check_effects()
        self.check_leaks()
        self.check_private_words()
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

    def check_module_loops(self, includes):
        """A header and its source file are one module: header A includes B while B's source includes A is a loop, too."""
        steps = {}  # module -> {module it includes: (source, line)}
        for source in sorted(includes):
            for line, target in includes[source]:
                if module_of(target) != module_of(source):
                    steps.setdefault(module_of(source), {}).setdefault(module_of(target), (source, line))
        seen = set()
        for start in sorted(steps):
            chain = shortest_loop(start, steps)
            key = tuple(sorted(chain))
            if not chain or key in seen:
                continue
            seen.add(key)
            if key in rules.MODULE_LOOPS_ALLOWED:
                continue
            source, line = steps[chain[0]][chain[1 % len(chain)]]
            hops = [f"{steps[a][b][0]} includes {b}" for a, b in zip(chain, chain[1:] + chain[:1])]
            self.report(source, line, "module-loop", "; ".join(hops),
                        "move what both need into a header of its own, or the function into the file that owns its data")
        for key in rules.MODULE_LOOPS_ALLOWED:
            if key not in seen:
                self.report("test/lint/rules.py", 1, "exemption-not-needed", f"the exemption from module-loop of {', '.join(key)} suppresses nothing",
                            "remove its row from MODULE_LOOPS_ALLOWED")

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
                lines, product = self.text[name].count("\n"), not inside(name, "test")
                limit = rules.MAX_LINES if product and name not in rules.LONG_FILES else rules.MAX_TEST_LINES
                if lines > limit:
                    self.report(name, limit + 1, "file-length", f"{lines} lines, the limit is {limit}", "split it: one idea per file")
                elif name in rules.LONG_FILES and lines <= rules.MAX_LINES:
                    self.report(name, 1, "exemption-not-needed", f"{lines} lines need no exemption from file-length",
                                "remove it from LONG_FILES in test/lint/rules.py")

        for folder in with_sources:
            count = sum(str(PurePosixPath(s).parent) == folder for s in self.sources)
            if count > rules.MAX_FOLDER_FILES:
                self.report(f"{folder}/README.md", 1, "folder-size", f"{count} source files in {folder}, the limit is {rules.MAX_FOLDER_FILES}",
                            "make a folder below it for each task")

    def check_room_sizes(self):
        lines = {}
        for source in self.sources:
            if not inside(source, "test"):
                lines[room_of(source)] = lines.get(room_of(source), 0) + self.text[source].count("\n")
        total = sum(lines.values())
        for room, count in lines.items():
            if room and total >= rules.ROOM_SHARE_FROM_LINES and count > rules.MAX_ROOM_SHARE * total:
                self.report(f"{room}/README.md", 1, "room-size",
                            f"{count} of {total} shipped lines, {100 * count / total:.1f} %; the limit is {100 * rules.MAX_ROOM_SHARE:.0f} %",
                            "divide the room by what its parts do, each with a row in ARROWS")

    # The page that a newcomer reads first must not go stale.
    def check_house_page(self):
        page = rules.HOUSE_PAGE
        if page not in self.text:
            return
        text = self.text[page]
        rows = {}
        for match in re.finditer(r"^\| `([\w/]+)` \|(?:.*\|)?([^|\n]*)\|$", text, re.MULTILINE):
            rows[match.group(1)] = (line_of(text, match.start()), re.findall(r"`([^`]+)`", match.group(2)))
        shipped = {room_of(s) for s in self.sources} - {"test", None}
        for room in sorted(shipped):
            allowed = rules.ARROWS[room]
            line, said = rows.pop(room, (1, None))
            for face in re.findall(r"\| `(\w+\.\w+)` \|", text.split("\n")[line - 1][len(f"| `{room}`"):]):
                if said is not None and f"{room}/{face}" not in self.files:
                    self.report(page, line, "room-table", f"{room} has no {face}", "name the file where reading this room begins")
            if said is None or sorted(said) != sorted(allowed):
                self.report(page, line, "room-table", f"{room}: the table says {said}, test/lint/rules.py {allowed}",
                            "write the row as ARROWS has it: " + ", ".join(f"`{a}`" for a in allowed))
        for room, (line, _) in rows.items():
            self.report(page, line, "room-table", f"{room} is no room of test/lint/rules.py that has sources", "remove the row")
        for start, section in self.walks(text):
            self.check_walk(page, start, section)

    @staticmethod
    def walks(text):
        """(offset, text) of each section below a heading `### Walk: ...`."""
        for match in re.finditer(r"^### Walk: .*?(?=^#|\Z)", text, re.MULTILINE | re.DOTALL):
            yield match.start(), match.group()

    def check_walk(self, page, start, section):
        text = self.text[page]
        hops = [(line_of(text, start + m.start()), m.group(1), m.group(2))
                for m in re.finditer(r"^\d+\. `([\w/.]+): ([\w:~]+)`", section, re.MULTILINE)]
        for line, path, function in hops:
            name = re.escape(function.split("::")[-1])
            if path not in self.text:
                self.report(page, line, "walk", f"{path} is no file of this repository", "say where the walk goes now")
            elif not re.search(rf"\b{name}\b(?:<[^;{{}}()]*>)?\s*\(|\b(?:struct|class)\s+{name}\b", without_comments_and_strings(self.text[path])):
                self.report(page, line, "walk", f"{path} has no {function}", "say where the walk goes now")
        between_files = sum(module_of(a[1]) != module_of(b[1]) for a, b in zip(hops, hops[1:]))
        entered = [room_of(hops[0][1])] if hops else []
        for _, path, _ in hops:
            if room_of(path) != entered[-1]:
                entered.append(room_of(path))
        again = sorted({str(r) for r in entered if entered.count(r) > 1})
        told = re.search(r"^Calls between files: (\d+) of (\d+)( \(missed\))?\. Rooms entered twice: ([^.\n]*)\.", section, re.MULTILINE)
        line = line_of(text, start + (told.start() if told else 0))
        truth = (f"Calls between files: {between_files} of {told.group(2) if told else 'N'}"
                 f"{' (missed)' if told and between_files > int(told.group(2)) else ''}. "
                 f"Rooms entered twice: {', '.join(f'`{r}`' for r in again) or 'none'}.")
        if not told or told.group(0) != truth:
            self.report(page, line, "walk", f"the walk is not as long as it says: {told.group(0) if told else 'no count'}", f"write: {truth}")

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

    def check_statements(self):
        for name in self.sources:
            for start, _, _, _ in joined_statements(without_comments_and_strings(self.text[name])):
                self.report(name, line_of(self.text[name], start), "joined-statements", "several expressions joined by commas are one statement",
                            "one statement a line")

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

    def report_named_effect(self, name, line, effect, named):
        named.add(name)
        if name not in rules.EFFECT_NAMED_IN:
            self.report(name, line, "effect-named", f"{effect} is named in general code",
                        "ask its row in the catalogue, or give its term a trait (host/effects/term.hpp)")

    # (j) Code and catalogue have the same effects, and nobody names one past the catalogue.
    def check_effects(self):
        catalogue = self.text.get(rules.CATALOGUE, "")
        rows = [dict(re.findall(r'^(id|kind|plant) = "?([\w]+)"?$', row, re.MULTILINE)) for row in catalogue.split("[[effect]]\n")[1:]]
        known = {row["id"] for row in rows}
        coded, named = {"model": {}, "plant": {}}, set()
        for name in self.sources:
            for match in re.finditer(r"\bhost::\w+::kId\b", self.text[name]) if name.startswith(rules.EFFECT_FREE_ROOMS) else []:
                self.report_named_effect(name, line_of(self.text[name], match.start()), match.group(), named)
            literals = list(re.finditer(r'"([a-z]\w*)"', without_comments(self.text[name])))
            for match in literals:
                before, effect = self.text[name][:match.start()], match.group(1)
                where = (name, line_of(self.text[name], match.start()))
                if inside(name, "host/effects") and re.search(r"\bkId = $", before):
                    coded["model"][effect] = where
                elif inside(name, "sim/effects") and not inside(name, "sim/effects/foreign") and re.search(r"\.id = $", before):
                    coded["plant"][effect] = where
                elif before.endswith("effect(") and effect not in known and name.startswith(rules.EFFECT_ROOMS):
                    self.report(*where, "effect-id", f'no row of the catalogue has the id "{effect}"', f"spell it as in {rules.CATALOGUE}, or add its row")
                elif effect in known and "_" in effect and name.startswith(rules.EFFECT_FREE_ROOMS) and name not in rules.EFFECT_ID_EXEMPT:
                    self.report_named_effect(*where, f'"{effect}"', named)
                elif effect in known and "_" in effect and name.startswith(rules.EFFECT_ROOMS) and name not in rules.EFFECT_ID_EXEMPT:
                    if not before.endswith(("effect(", "find_term(")):
                        self.report(*where, "effect-id", f'"{effect}" is named past the catalogue', f'take its row: host::effect("{effect}")')
        for name in set(rules.EFFECT_NAMED_IN) & set(self.sources) - named:
            self.report(name, 1, "exemption-not-needed", "it names no effect", "remove it from EFFECT_NAMED_IN in test/lint/rules.py")
        for side, has in (("model", lambda row: row.get("kind") in ("term", "dynamic", "sensor")), ("plant", lambda row: row.get("plant") == "true")):
            wanted = {row["id"] for row in rows if has(row)}
            for effect, where in coded[side].items():
                if effect not in known:
                    self.report(*where, "effect-row", f'the effect "{effect}" has no row', f"describe it in {rules.CATALOGUE}")
            for effect in wanted - set(coded[side]):
                line = line_of(catalogue, catalogue.index(f'id = "{effect}"'))
                self.report(rules.CATALOGUE, line, "effect-code", f'the {side} that "{effect}" promises has no code',
                            "write its file, or set kind = \"none\" (plant = false)")

    # (i)
    def check_leaks(self):
        for rule, pattern, what, remedy in rules.LEAKS:
            compiled = re.compile(pattern)
            for name, text in self.text.items():
                if name in rules.LEAK_EXEMPT:
                    continue
                for match in compiled.finditer(text):
                    self.report(name, line_of(text, match.start()), rule, what.format(match.group()), remedy)

    # (i)
    def check_private_words(self):
        allowed = re.compile(rules.PRIVATE_WORDS_ALLOWED, re.MULTILINE)
        words = [(re.compile(pattern), field_word) for pattern, field_word in rules.PRIVATE_WORDS]
        for name, text in self.text.items():
            if name in rules.PRIVATE_WORD_EXEMPT or not name.endswith(rules.PRIVATE_WORD_SUFFIXES):
                continue
            plain = allowed.sub(lambda m: _blank(m.group()), text)
            for pattern, field_word in words:
                for match in pattern.finditer(plain):
                    self.report(name, line_of(plain, match.start()), "private-word", f"`{match.group()}` is no word of the field",
                                f"say: {field_word} (docs/glossary.md), or list the key of a file in PRIVATE_WORDS_ALLOWED")


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
