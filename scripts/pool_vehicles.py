"""One vehicle file from several that were identified from flights of the same kind: values are means, and u is what one such set of
flights knows together with the scatter between the sets, so that the file is an honest prior for one more set.

  python3 scripts/pool_vehicles.py A.toml B.toml … -o POOLED.toml

All files must come from the same vehicle file and command: same quantities in the same order.
"""

import argparse
import math
import pathlib
import re
import sys
import tomllib

NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
QUANTITY = re.compile(rf"value = ({NUMBER}|\[[^\]]*\]), (u(?:_rad)?) = ({NUMBER}|\[[^\]]*\])")
MATRIX = re.compile(r"matrix = \[([^\]]*)\]")


def numbers(text):
    return [float(x) for x in re.findall(NUMBER, text)]


def listed(values, like):
    return f"[{', '.join(repr(v) for v in values)}]" if like.startswith("[") else repr(values[0])


def mean(values):
    return sum(values) / len(values)


def scatter(values):
    m = mean(values)
    return math.sqrt(sum((v - m) ** 2 for v in values) / (len(values) - 1)) if len(values) > 1 else 0.0


def pooled(texts):
    """The first text with every value and u replaced."""
    found = [list(QUANTITY.finditer(t)) for t in texts]
    if len({len(f) for f in found}) != 1:
        sys.exit("error: the files do not hold the same quantities\n  do: identify all of them from one vehicle file with one command")
    out, at = [], 0
    for place in zip(*found):
        values, us = [numbers(m[1]) for m in place], [numbers(m[3]) for m in place]
        middle = [mean(v) for v in zip(*values)]
        # An attitude's u is that of the small turn, twice the vector part of its quaternion.
        moved = [[2.0 * x for x in v[1:]] for v in values] if place[0][2] == "u_rad" else values
        u = [math.hypot(mean(one_u), scatter(v)) for one_u, v in zip(zip(*us), zip(*moved))]
        first = place[0]
        out += [texts[0][at:first.start()], f"value = {listed(middle, first[1])}, {first[2]} = {listed(u, first[3])}"]
        at = first.end()
    return "".join([*out, texts[0][at:]])


def covariance(texts, text):
    """The mean correlation with the new u on both sides: stays positive definite, and agrees with the quantities' own u."""
    blocks = [[b["matrix"] for b in tomllib.loads(t).get("covariance", [])] for t in texts]

    def one(which):
        def replace(_):
            k = next(which)
            n = math.isqrt(len(blocks[0][k]))
            variance = [mean([b[k][i * n + i] for b in blocks]) for i in range(n)]
            extra = next(extras)
            root = [math.sqrt((variance[i] + extra[i]) / variance[i]) for i in range(n)]
            middle = [mean([b[k][i] for b in blocks]) for i in range(n * n)]
            cells = [middle[i * n + j] * root[i] * root[j] for i in range(n) for j in range(n)]
            return f"matrix = [{', '.join(repr(c) for c in cells)}]"
        return replace

    names = [b["of"] for b in tomllib.loads(texts[0]).get("covariance", [])]
    files = [tomllib.loads(t) for t in texts]
    extras = iter([[scatter([quantity(f, n) for f in files]) ** 2 for n in block] for block in names])
    return MATRIX.sub(one(iter(range(len(names)))), text)


def quantity(file, name):
    """The value that a name of a covariance block stands for (docs/files.md)."""
    parts = name.split(".")
    if parts[0] == "effect":
        return next(e for e in file["effect"] if e["id"] == parts[1])["parameter"][parts[2]]["value"]
    group = file[parts[0]]
    if parts[0] == "pose_sensor":
        axis = "xyz".index(parts[2])
        return group["offset_m"]["value"][axis] if parts[1] == "offset" else 2.0 * group["quaternion_wxyz"]["value"][1 + axis]
    key = next(k for k in group if k == parts[1] or k.startswith(parts[1] + "_"))
    return (group[key][parts[2]] if len(parts) > 2 else group[key])["value"]


def main():
    parser = argparse.ArgumentParser(description="one vehicle file from several of the same kind")
    parser.add_argument("files", nargs="+", type=pathlib.Path)
    parser.add_argument("-o", "--out", type=pathlib.Path, required=True)
    o = parser.parse_args()
    texts = [f.read_text(encoding="utf-8") for f in o.files]
    o.out.write_text(covariance(texts, pooled(texts)), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
