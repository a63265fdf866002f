"""Longest path of a function for a Cortex-M4F, in instructions or cycles, with all that it calls.

usage: worst_path.py FILE FUNCTION [--cycles] [--limit CYCLES] [--without NAME ...]
FILE: an object, or a linked program. --without: functions whose mangled name holds NAME count for nothing.
--cycles: of a linked program, by the table of sim/mcu/core/costs.hpp (Arm's manual), entry, return and the registers of the FPU included, each
taken branch with its refill: with zero wait states, and with 4 wait states for each 64-bit word of the flash, neither prefetch nor cache.
--limit: of the latter; exit code 6 beyond it.

A path in the program, whether or not any state of it takes it: an upper bound. Loops are those over the three phases and
count three times; memcpy and memset count 30 in an object.
"""
import argparse
import functools
import re
import subprocess
import sys

PHASES, LIBRARY = 3, 30
REFILL, EXCEPTION, WAIT_STATES = 2, 12 + 17 + 10, 4
VENEER = 4 + WAIT_STATES  # ldr pc, [pc]
COSTS = (("vdiv", 14), ("vsqrt", 14), (("vmla", "vmls", "vnmla", "vnmls"), 3), (("vldr", "vstr"), 2), (("sdiv", "udiv"), 12), (("mla", "mls"), 2),
         (("tbb", "tbh"), 4), (("mrs", "msr"), 2), (("ldrex", "strex"), 2))
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
        elif now and (code := re.match(r"\s*([0-9a-f]+):\t(\S+)\s*(.*)", line)):
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
    """Of each instruction: which may follow, and which function it calls. A taken branch passes the odd address behind it, which costs its refill."""
    code, data, names = function
    order = sorted(code)
    after, calls = {}, {}
    for at, following in zip(order, order[1:] + [None]):
        op, words = code[at]
        aim = re.match(r"(?:\w+, )?([0-9a-f]+) <([^+>]+)(\+0x[0-9a-f]+)?>", words)
        elsewhere = names.get(at) or (aim[2] if aim and int(aim[1], 16) not in code else None)
        if op in ("bl", "blx"):
            calls[at], to = elsewhere or "", [following]
        elif op in ("tbb", "tbh"):
            to = table(data, code, at, 1 if op == "tbb" else 2)
        elif op == "b":
            calls[at], to = elsewhere, [] if elsewhere else [int(aim[1], 16)]
        elif op in CONDITIONAL and elsewhere:
            calls[at], to = elsewhere, [following]
        elif op in CONDITIONAL:
            after[at + 1] = [int(aim[1], 16)]
            to = [at + 1, following]
        else:
            to = [] if op == "bx" or (op in ("pop", "ldmia") and "pc" in words) else [following]
        after[at] = [a for a in to if a in code or a in after]
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


def registers(words):
    """How many a list in braces names."""
    total = 0
    for part in re.search(r"\{(.+)\}", words)[1].split(","):
        ends = re.findall(r"\d+", part)
        total += int(ends[1]) - int(ends[0]) + 1 if "-" in part else 1
    return total * (2 if re.search(r"\{d\d", words) else 1)


def cycles(op, words):
    """With zero wait states, a branch not taken; sim/mcu/core/costs.hpp."""
    if op in ("push", "pop", "vpush", "vpop") or op.startswith(("ldm", "stm", "vldm", "vstm")):
        return 1 + registers(words) + (REFILL if "pc" in words else 0)
    if op in ("b", "bx", "bl", "blx"):
        return 1 + REFILL
    if op.startswith(("ldrd", "strd")):
        return 3
    if op.startswith("ldr"):
        return 2 + (REFILL if words.startswith("pc") else 0)
    for starts, cost in COSTS:
        if op.startswith(starts):
            return cost
    return 1


def flash_waits(function, at):
    """Of an instruction in the flash (0x08000000) with which a 64-bit word begins, or in whose first half it began."""
    code = function[0]
    return WAIT_STATES if at >> 27 == 1 and (at % 8 == 0 or at % 8 == 2 and at - 2 not in code and at - 4 in code) else 0


def worst(functions, function, weigh, library, without):
    @functools.lru_cache(None)
    def cost(name):
        if any(w in name for w in without):
            return 0
        if name not in functions:
            if library is None:
                sys.exit(f"'{name or 'an address in a register'}' is called and is no function of the program")
            return library
        if name.endswith("_veneer"):
            target = re.match(r"__(.+)_veneer", name)[1]
            return VENEER + cost(target if target in functions else "_" + target)
        start, after, calls = flow(functions[name])
        weight = {at: weigh(functions[name], at) + (cost(calls[at]) if at in calls else 0) for at in after}
        return longest(after, weight, set(after), start, set())

    if function not in functions:
        sys.exit(f"there is no function '{function}'; there are {', '.join(sorted(functions)[:5])} and others")
    return cost(function)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file")
    parser.add_argument("function")
    parser.add_argument("--cycles", action="store_true")
    parser.add_argument("--limit", type=int)
    parser.add_argument("--without", nargs="*", default=[])
    o = parser.parse_args()
    functions = read(o.file)
    if not o.cycles:
        print(worst(functions, o.function, lambda f, at: 1 - at % 2, LIBRARY, o.without))
        return 0

    def zero_wait(f, at):
        return REFILL if at % 2 else cycles(*f[0][at])

    def from_flash(f, at):
        return zero_wait(f, at) + (0 if at % 2 else flash_waits(f, at))

    zero, flash = (EXCEPTION + worst(functions, o.function, weigh, None, o.without) for weigh in (zero_wait, from_flash))
    print(f"longest path of {o.function}: {zero} cycles with zero wait states, {flash} with those of the flash"
          + (f" (limit {o.limit}{' **missed**' if flash > o.limit else ''})" if o.limit else ""))
    return 6 if o.limit and flash > o.limit else 0


if __name__ == "__main__":
    sys.exit(main())
