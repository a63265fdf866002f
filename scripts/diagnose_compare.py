#!/usr/bin/env python3
"""Two programs judged on the same flights: scripts/diagnose_compare.py OLD NEW, two folders of scripts/stats diagnose (--out).

Only trials that both folders hold are counted, each against itself. Prints for each kind how many are right by both, by one alone and by
none, the exact probability of so uneven a split by chance (McNemar's test, two-sided), and every trial whose outcome changed. Ends with 6
when a kind loses more than one trial and more than 2 points, or when more trials have a wrong name than before.
"""

import argparse
import collections
import math
import pathlib
import sys

import diagnose_score as score

MOST_TRIALS, MOST_POINTS = 1, 2.0


def by_chance(gained, lost):
    """Probability that a fair coin splits the trials that changed at least as unevenly as this."""
    n, k = gained + lost, min(gained, lost)
    return min(1.0, 2.0 * sum(math.comb(n, i) for i in range(k + 1)) / 2.0**n)


def trials(out):
    """(case, seed) -> (kind, right, wrong, the answer in words) of every finished trial below `out`."""
    found = {}
    for path in sorted(pathlib.Path(out).glob("*/*/trial.json")):
        trial, result = score.read(path.parent)
        judged, wrong = score.outcome(trial, result)
        found[trial["case"], trial["seed"]] = (trial["kind"], judged == "right", wrong, f"{judged}: {score.said(result)}")
    return found


def compare(old, new):
    """Lines of the page, and whether anything was lost."""
    both = sorted(old.keys() & new.keys())
    counts = collections.defaultdict(collections.Counter)
    for key in both:
        kind, was_right, was_wrong, _ = old[key]
        _, is_right, is_wrong, _ = new[key]
        counts[kind][was_right, is_right] += 1
        counts[kind]["wrong before"] += was_wrong
        counts[kind]["wrong now"] += is_wrong
    lost_any = False
    lines = ["| kind | trials | right by both | only before | only now | by neither | p | wrong name before | now | |",
             "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | --- |"]
    for kind, c in sorted(counts.items()):
        n = sum(c[a, b] for a in (True, False) for b in (True, False))
        lost, gained = c[True, False], c[False, True]
        worse = lost - gained > MOST_TRIALS and 100.0 * (lost - gained) > MOST_POINTS * n
        lost_any |= worse
        lines.append(f"| {kind} | {n} | {c[True, True]} | {lost} | {gained} | {c[False, False]} | {by_chance(gained, lost):.2g} | "
                     f"{c['wrong before']} | {c['wrong now']} | {'**loses**' if worse else ''} |")
    wrong = [sum(c[k] for c in counts.values()) for k in ("wrong before", "wrong now")]
    lines += ["", f"{len(both)} trials in both; a wrong name in {wrong[0]} before, {wrong[1]} now."]
    changed = [f"- `{case}` seed {seed}: {old[case, seed][3]} -> {new[case, seed][3]}" for case, seed in both
               if old[case, seed][1:3] != new[case, seed][1:3]]
    return [*lines, "", *(changed or ["No trial changed its outcome."])], lost_any or wrong[1] > wrong[0]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("old", type=pathlib.Path)
    parser.add_argument("new", type=pathlib.Path)
    o = parser.parse_args()
    old, new = trials(o.old), trials(o.new)
    if not old.keys() & new.keys():
        sys.exit(f"error: {o.old} ({len(old)} trials) and {o.new} ({len(new)} trials) have none in common\n"
                 "  do: give the --out folders of two studies of the same seeds; --keep-logs and --program let the second read the flights of the first")
    lines, lost = compare(old, new)
    print("\n".join(lines))
    return 6 if lost else 0


if __name__ == "__main__":
    sys.exit(main())
