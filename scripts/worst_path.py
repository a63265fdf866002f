"""Longest path of a function through an object file for a Cortex-M4F, in instructions, with all that it calls.

usage: worst_path.py OBJECT FUNCTION [--without NAME ...]     --without: functions whose mangled name holds NAME count for nothing

A path in the object, whether or not any state of the program takes it: an upper bound. Loops are those over the three phases and
count three times; memcpy and memset count 30.
"""
import functools
import re
import subprocess
import sys

PHASES, LIBRARY = 3, 30
CONDITIONAL = {"b" + c for c in "eq ne cs cc mi pl vs vc hi ls ge lt gt le".split()} | {"cbz", "cbnz"}


def read(path):
    """Functions by name: instructions and bytes of data by address, and the names that relocations put in."""
    functions, now = {}, None
    out = subprocess.run(["arm-none-eabi-objdump", "-dr", "--no-show-raw-insn", path], check=True, capture_output=True, text=True).stdout
    for line in out.splitlines():
        if head := re.match(r"[0-9a-f]+ <(.+)>:$", line):
            now = functions.setdefault(head[1], ({}, {}, {}))
        elif now and (name := re.match(r"\s+([0-9a-f]+): R_ARM_THM_\S+\s+([^\s+]+)", line)):
            now[2][int(name[1], 16)] = name[2]
        elif now and (code := re.match(r"\s+([0-9a-f]+):\t(\S+)\s*(.*)", line)):
            at, width = int(code[1], 16), {".byte": 1, ".short": 2, ".word": 4}.get(code[2])
            if width:
                now[1].update({at + k: int(code[3].split()[0], 16) >> 8 * k & 255 for k in range(width)})
            else:
                now[0][at] = (code[2].split(".")[0], code[3])
    return functions


def table(data, code, at, width):
    """Targets of a tbb or tbh at `at`: offsets from the first of them, in half-words."""
    targets, k = [], at + 4
    while k in data and k not in code:
        target = at + 4 + 2 * (data[k] + (data.get(k + 1, 0) << 8 if width == 2 else 0))
        targets += [target] if target != at + 4 else []
        k += width
    return targets


def flow(function):
    """Of each instruction: which may follow, and which function it calls."""
    code, data, names = function
    order = sorted(code)
    after, calls = {}, {}
    for at, following in zip(order, order[1:] + [None]):
        op, words = code[at]
        aim = re.match(r"(?:\w+, )?([0-9a-f]+) <", words)
        if op in ("bl", "blx"):
            calls[at], to = names.get(at, ""), [following]
        elif op in ("tbb", "tbh"):
            to = table(data, code, at, 1 if op == "tbb" else 2)
        elif op == "b":
            calls[at], to = names.get(at), [] if at in names else [int(aim[1], 16)]
        elif op in CONDITIONAL:
            to = [int(aim[1], 16), following]
        else:
            to = [] if op == "bx" or (op in ("pop", "ldmia") and "pc" in words) else [following]
        after[at] = [a for a in to if a in code]
    return order[0], after, {at: name for at, name in calls.items() if name}


def components(after, nodes, start, cut):
    """Strongly connected parts that `start` reaches, each after all that follow it (Tarjan)."""
    index, low, stack, parts = {}, {}, [], []
    steps = [(start, iter(after[start]))]
    index[start] = low[start] = 0
    stack.append(start)
    while steps:
        at, rest = steps[-1]
        to = next((a for a in rest if a in nodes and (at, a) not in cut and (a not in index or a in stack)), None)
        if to is None:
            steps.pop()
            if steps:
                low[steps[-1][0]] = min(low[steps[-1][0]], low[at])
            if low[at] == index[at]:
                k = stack.index(at)
                parts.append(stack[k:])
                del stack[k:]
        elif to in index:
            low[at] = min(low[at], index[to])
        else:
            index[to] = low[to] = len(index)
            stack.append(to)
            steps.append((to, iter(after[to])))
    return parts


def longest(after, weight, nodes, start, cut):
    best = {}  # by instruction: from its part on
    for part in components(after, nodes, start, cut):
        inside = set(part)
        rest = max((best[a] for at in part for a in after[at] if a in best and (at, a) not in cut), default=0)
        loops = any(a in inside and (at, a) not in cut for at in part for a in after[at])
        if loops:
            head = part[0]  # where the search entered it
            cut |= {(at, head) for at in part if head in after[at]}
            length = PHASES * longest(after, weight, inside, head, cut)
        else:
            length = weight[part[0]]
        best.update({at: length + rest for at in part})
    return best[start]


def main(path, function, without):
    functions = read(path)

    @functools.lru_cache(None)
    def cost(name):
        if any(w in name for w in without):
            return 0
        if name not in functions:
            return LIBRARY
        start, after, calls = flow(functions[name])
        weight = {at: 1 + (cost(calls[at]) if at in calls else 0) for at in after}
        return longest(after, weight, set(after), start, set())

    if function not in functions:
        sys.exit(f"{path}: no function '{function}'; it has {', '.join(sorted(functions)[:5])} and others")
    print(cost(function))
    return 0


if __name__ == "__main__":
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1], sys.argv[2], [a for a in sys.argv[3:] if a != "--without"]))
