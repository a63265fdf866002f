"""Bound of the stack of a linked program: what each function's instructions take, along the deepest path of the calls in the ELF. The .su files
of the build say whether any of it grows at run time.

An indirect call may reach every function whose address is taken in data or code (the getters and setters of parameters). Interrupts add up: the
main loop, then the CAN interrupt, then the sample interrupt, then a fault or NMI, each with the frame that the processor pushes.
"""
import dataclasses
import functools
import pathlib
import re
import subprocess

PUSHED = 26 * 4 + 4  # registers with those of the FPU, and a word of alignment
ENTRIES = ("reset_handler", "can_interrupt", "sample_interrupt", "nmi_handler")
WRITTEN_IN_ASSEMBLER = {"fault_entry": 0, "nmi_handler": 8}


@dataclasses.dataclass
class Bound:
    depths: dict
    loops: list
    unknown: list

    @property
    def total(self):
        return sum(self.depths.values()) + PUSHED * (len(self.depths) - 1)

    def text(self):
        return ", ".join(f"{name} {depth}" for name, depth in self.depths.items()) + f", pushed by the processor {PUSHED} each; in all {self.total}"


def tool(name, *words):
    return subprocess.run(["arm-none-eabi-" + name, *map(str, words)], check=True, capture_output=True, text=True).stdout


def frames_said(elf):
    """What the compiler says of each function of the objects that were linked into it: name, bytes, "static" or why it is not. Another program of
    the same build may hold the same function with another frame."""
    build = elf.resolve().parent.parent
    linked = [build / m for m in re.findall(r"^LOAD (\S+\.obj)$", elf.with_suffix(".map").read_text(), re.M)]
    return [line.split("\t") for o in linked for line in o.with_suffix(".su").read_text().splitlines()]


def pushed_by(code):
    """Bytes that a function's own instructions take of the stack; libgcc's have no .su line, and what is inlined is in there."""
    depth = 0
    for op, words in code:
        registers = re.search(r"\{(.+)\}", words)
        if op.startswith(("push", "stmdb")) and registers and (op.startswith("push") or words.startswith("sp!")):
            depth += 4 * count(registers[1])
        elif op.startswith("vpush"):
            depth += 4 * count(registers[1]) * (2 if "d" in registers[1] else 1)
        elif op.startswith("sub") and (found := re.match(r"sp, (?:sp, )?#(\d+)", words)):
            depth += int(found[1])
        elif op.startswith("str") and (found := re.search(r"\[sp, #-(\d+)\]!", words)):
            depth += int(found[1])
    return depth


def count(registers):
    total = 0
    for part in registers.split(","):
        ends = re.findall(r"\d+", part)
        total += int(ends[1]) - int(ends[0]) + 1 if "-" in part else 1
    return total


def read(elf):
    """By name: instructions (op, words)."""
    functions, now = {}, None
    for line in tool("objdump", "-d", "--no-show-raw-insn", elf).splitlines():
        if head := re.match(r"([0-9a-f]+) <(.+)>:$", line):
            now = functions.setdefault(head[2], [])
        elif now is not None and (code := re.match(r"\s*[0-9a-f]+:\t(\S+)\s*(.*)", line)):
            now.append((code[1], code[2]))
    return functions


def calls(functions, addressed):
    """By name: whom it may call; a jump to another function is a call as well."""
    graph = {}
    for name, code in functions.items():
        to = set()
        for op, words in code:
            aim = re.search(r"<([^+>]+)>", words)
            if op.startswith("b") and aim and aim[1] != name and aim[1] in functions:
                to.add(aim[1])
            elif op in ("blx",) and not aim:
                to |= addressed
        if name.endswith("_veneer"):
            target = re.match(r"__(.+)_veneer", name)[1]
            to.add(target if target in functions else "_" + target)
        graph[name] = {t for t in to if t in functions}
    return graph


def address_taken(elf, functions):
    """Functions whose address lies in a table of data. Vectors are no targets of a call."""
    at = {}
    for line in tool("nm", elf).splitlines():
        w = line.split()
        if len(w) == 3 and w[1] in "tTwW" and w[2] in functions:
            at[int(w[0], 16) | 1] = w[2]
    words = set()
    for section in (".rodata", ".data"):
        for line in tool("objdump", "-s", "-j", section, elf).splitlines():
            found = re.match(r" [0-9a-f]+ ((?:[0-9a-f]{2,8} ){1,4})", line)
            if found:
                words |= {int.from_bytes(bytes.fromhex(word), "little") for word in found[1].split() if len(word) == 8}
    return {name for address, name in at.items() if address in words and name not in ENTRIES}


def bound(elf):
    elf = pathlib.Path(elf)
    functions = read(elf)
    graph = calls(functions, address_taken(elf, functions))
    sizes = {name: WRITTEN_IN_ASSEMBLER.get(name, pushed_by(code)) for name, code in functions.items()}
    loops = []

    @functools.cache
    def depth(name):
        return sizes[name] + max((depth(to) for to in sorted(graph[name])), default=0)

    def walk(name, path, done):
        if name in path:
            loops.append([*path[path.index(name):], name])
            graph[path[-1]].discard(name)
            return
        if name in done:
            return
        for to in sorted(graph[name]):
            walk(to, [*path, name], done)
        done.add(name)

    done = set()
    entries = [name for name in ENTRIES if name in graph]
    for entry in entries:
        walk(entry, [], done)
    said = frames_said(elf)
    unknown = [f"{name}: it grows ({kind})" for name, _, kind in said if kind != "static"]
    if max((int(size) for _, size, _ in said), default=0) > max(sizes.values(), default=0):
        unknown.append("a function: the compiler says a larger one than the instructions show")
    if not said:
        unknown.append("any function: the .su files of the build are missing")
    return Bound({entry: depth(entry) for entry in entries}, loops, unknown)
