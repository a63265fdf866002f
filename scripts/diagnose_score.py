"""Judges what diagnoses said against what the plants had: rules, counts, confusion table. See scripts/diagnose_study.py.

An answer is a list of sets: each effect that was added, with those indistinguishable from it. The rules, one outcome for a trial:
  separable       right: the first answer is the effect, alone
  class_only      right: a set of up to three holds the effect, with the manoeuvre that separates them when it has more than one member
  not_observable  right: verdict clean, and the effect stands in not_observable. silent: clean, but not listed
  pair            right: both are in the answer. half: one is
  foreign         right: verdict unexplained and nothing named
  clean           right: verdict clean
  sensor          right: the error of the sensor is in the only set, of at most three; sensor_pair: it and the effect, each in a set, no other set
  log_error       right: the checks say what was done to the log, and the rest is answered as if it had not been done
  foreign_part    right: verdict unexplained, whatever is named under that reserve; the share with nothing named, as `foreign` asks, beside it
Otherwise inside (the effect is in an answer, but not so), missed (nothing named) or wrong. Beside the outcome, `wrong` counts every trial with any set that holds nothing of the truth.
"""

import collections
import json
import math

LARGEST_CLASS = 3
HEAD = """# Which unmodelled effects a diagnosis finds in simulated flights

Command: `scripts/stats diagnose --table docs/acceptance/diagnose_hil.md` (resumable; exit code 6 when a limit is missed). This page is made by it.

**Flights.** `scenarios/diagnose.toml`: three of 20 s, the same for all, reference plant and sensors, flown with `vehicles/calibrated.toml`, noise and gusts of each
flight drawn for it alone. The plant gets one effect of `effects/catalogue.toml` at its typical value, unless it has it by itself; where the vehicle file holds the
effect, the file loses it. Exceptions, pairs and foreign effects with their sizes and reasons: `scripts/diagnose_study.toml`.
**Nominal model.** `vehicles/hil_baseline.toml`: eq. 1-5 and the findings of the plant as its file says, identified from seeds 301 to 306 and pooled, frozen before the study.
**Judged.** By the rules at the head of `scripts/diagnose_score.py`; no answer is looked at by hand. A trial without a
result does not count as right. Flights that ended early are listed below; their trials are judged like the others.
"""

HEAD_SENSORS = """# Errors of sensors and logs, and foreign physics in a part of the flights

Command: `scripts/stats diagnose-sensors --table docs/acceptance/diagnose_sensors.md` (resumable; exit code 6 when a limit is missed). This page is made by it.

**Flights.** As of [diagnose_hil.md](diagnose_hil.md). Kinds and ranges of size: `scripts/diagnose_sensors.toml`; the size of a trial is drawn from its seed. Foreign physics is
flown in five flights (vertical and horizontal twice).
**Judged.** By the rules at the head of `scripts/diagnose_score.py`; no answer is looked at by hand.
"""

LIMITS = [  # what, kinds, outcome that counts, least share
    ("separable: named first and alone", ("separable",), "right", 0.90),
    ("class only: a class of at most three holds it", ("class_only",), "right", 0.90),
    ("not observable: said so", ("not_observable",), "right", 0.90),
    ("two at once: both in the answer", ("pair",), "right", 0.80),
    ("foreign: unexplained, no name", ("foreign",), "right", 0.75),
    ("clean, plant of eq. 1-8", ("clean_reduced",), "right", 0.95),
    ("clean, full plant with its findings", ("clean_full",), "right", 0.95),
    ("errors of sensors and logs, alone and beside an effect", ("sensor", "sensor_pair", "log_error"), "right", 0.90),
    ("foreign, in one flight, at one place, by a product: unexplained", ("foreign_part",), "right", 0.80),
]
SINGLE = ("separable", "class_only", "not_observable")  # kinds with one effect
MOST_WRONG = 0.02
DRAWN = ("sensor", "sensor_pair", "log_error", "foreign_part")  # kinds of scripts/diagnose_sensors.toml
MOST_WRONG_DRAWN = 0.01
LEAST_OF_EACH = 0.7  # of a single effect's trials


def answer_sets(result):
    return [(a["id"], *(t["id"] for t in a.get("twins", []))) for a in result.get("added", [])]


def outcome(trial, result):
    """(outcome, wrong): of one trial."""
    kind, truth = trial["kind"], set(trial["truth"])
    sets, verdict = answer_sets(result), result["verdict"]
    wrong = any(truth.isdisjoint(s) for s in sets)
    holding = [i for i, s in enumerate(sets) if not truth.isdisjoint(s)]
    otherwise = "inside" if holding else "wrong" if sets else "missed"
    if kind in ("clean_full", "clean_reduced"):
        return ("right" if verdict == "clean" else "wrong" if sets else "false alarm"), wrong
    if kind == "foreign":
        return ("right" if verdict == "unexplained" and not sets else "wrong" if sets else "missed"), wrong
    if kind in ("sensor", "sensor_pair", "log_error"):
        wrong = wrong and verdict != "unexplained"  # a name under that reserve is none
        found = all(any(t in s and len(s) <= LARGEST_CLASS for s in sets) for t in truth)
        noted = trial.get("says", "") in " ".join(f["what"] for f in result.get("left_out", []) + result.get("faults", []))
        if found and noted and len(holding) == len(sets) and (truth or verdict == "clean"):
            return "right", wrong
        return ("half" if holding else otherwise), wrong
    if kind == "foreign_part":
        return ("right" if verdict == "unexplained" else "wrong" if sets else "missed"), wrong and verdict != "unexplained"
    if kind == "pair":
        found = truth & {i for s in sets for i in s}
        return ("right" if found == truth else "half" if found else "wrong" if sets else "missed"), wrong
    if kind == "not_observable":
        listed = truth <= {n["id"] for n in result.get("not_observable", [])}
        return ("wrong" if sets else "right" if verdict == "clean" and listed else "silent" if verdict == "clean" else "missed"), wrong
    if kind == "separable":
        return ("right" if sets and sets[0] == tuple(trial["truth"]) else otherwise), wrong
    named = [i for i in holding if len(sets[i]) == 1 or (len(sets[i]) <= LARGEST_CLASS and result["added"][i].get("manoeuvre"))]
    return ("right" if named else otherwise), wrong


def read(folder):
    """The trial and what was said, or None for what is not complete."""
    try:
        trial = json.loads((folder / "trial.json").read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    try:
        return trial, json.loads((folder / "result.json").read_text(encoding="utf-8"))
    except (FileNotFoundError, json.JSONDecodeError):
        return trial, {"verdict": f"no result, exit {trial['exit']}"}


def said(result):
    """The answer in words: "a | b, c" is an effect named, then a class of two."""
    return " | ".join(", ".join(s) for s in answer_sets(result)) or result["verdict"]


def in_words(folder):
    trial, result = read(folder)
    judged, wrong = outcome(trial, result)
    return f"{judged}{' (and a wrong name)' if wrong and judged != 'wrong' else ''}: {result['verdict']}, {said(result)}, {trial['wall_s']} s"


def interval(hits, n):
    """Wilson's 95 % interval of a share."""
    z, p = 1.96, hits / n
    middle, half = p + z * z / (2 * n), z * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return (middle - half) / (1 + z * z / n), (middle + half) / (1 + z * z / n)


def percent(hits, n):
    low, high = interval(hits, n)
    return f"{100 * hits / n:.1f} % ({hits} of {n}; 95 %: {100 * low:.0f} to {100 * high:.0f})"


def page(out, wanted, head=HEAD):
    """The page as Markdown, and whether a limit was missed."""
    judged = collections.defaultdict(list)  # case -> [(outcome, wrong, answer, seed)]
    kinds, unflown = {c.name: c.kind for c in wanted}, []
    for c in wanted:
        for folder in sorted((out / c.name).glob("*"), key=lambda f: f.name):
            both = read(folder)
            if both is None:
                continue
            trial, result = both
            trial["kind"] = c.kind  # as the study has it now; the answer does not depend on it
            judged[c.name].append((*outcome(trial, result), said(result), trial["seed"]))
            unflown += [f"`{c.name}` seed {trial['seed']}: {flight} {end}" for flight, end in trial["ends"].items() if end != "completed"]
    lines, missed = summary(judged, kinds, {c.name for c in wanted if c.blade_level})
    clean = {t[3] for name, trials in judged.items() for t in trials if kinds[name].startswith("clean")}
    others = {t[3] for name, trials in judged.items() for t in trials if not kinds[name].startswith("clean")}
    run = [f"{what}{spans(seeds)}" for what, seeds in (("Seeds ", others), ("clean controls ", clean)) if seeds]
    lines = [head, "; ".join(run) + ".\n" if run else "No trial yet.\n", *lines, ""]
    lines += table(judged, kinds)
    lines += ["", "## Flights that did not end as planned", "", *([f"- {u}" for u in unflown] or ["None."])]
    return "\n".join(lines) + "\n", missed


def spans(seeds):
    """{1, 2, 3, 5} as '1 to 3, 5'."""
    runs = []
    for s in sorted(seeds):
        if runs and s == runs[-1][1] + 1:
            runs[-1][1] = s
        else:
            runs.append([s, s])
    return ", ".join(str(a) if a == b else f"{a} to {b}" for a, b in runs)


def summary(judged, kinds, blade_level=frozenset()):
    lines, missed = ["| what | measured | limit | |", "| --- | --- | --- | --- |"], False

    def row(what, measured, limit, ok):
        nonlocal missed
        missed |= not ok
        lines.append(f"| {what} | {measured} | {limit} | {'' if ok else '**missed**'} |")

    for what, of, right, least in LIMITS:
        trials = [t for name, ts in judged.items() if kinds[name] in of for t in ts]
        hits = sum(t[0] == right for t in trials)
        if trials:
            row(what, percent(hits, len(trials)), f"≥ {100 * least:.0f} %", hits >= least * len(trials))
        if trials and "foreign_part" in of:
            row("… of these, and nothing named under that reserve", percent(sum(t[0] == right and t[2] == "unexplained" for t in trials), len(trials)),
                "–", True)
    effects = [n for n in judged if kinds[n] in SINGLE]
    for what, names in (("model's own form", [n for n in effects if n not in blade_level]), ("blade elements and wakes", [n for n in effects if n in blade_level])):
        trials = [t for n in names for t in judged[n]]
        if trials and blade_level:
            row(f"single effects, plant of {what}", percent(sum(t[0] == "right" for t in trials), len(trials)), "–", True)
    weak = [n for n in effects if sum(t[0] == "right" for t in judged[n]) < LEAST_OF_EACH * len(judged[n])]
    if effects:
        row("single effects below 7 of 10", f"{len(weak)} of {len(effects)}", "0", not weak)
        trials = [t for n in effects for t in judged[n]]
        wrong = sum(t[1] for t in trials)
        row("confidently wrong: any name or class without the truth", percent(wrong, len(trials)), f"≤ {100 * MOST_WRONG:.0f} %",
            wrong <= MOST_WRONG * len(trials))
    trials = [t for n in judged if kinds[n] in DRAWN for t in judged[n]]
    if trials:
        wrong = sum(t[1] for t in trials)
        row("a wrong name without reserve", percent(wrong, len(trials)), f"≤ {100 * MOST_WRONG_DRAWN:.0f} %", wrong <= MOST_WRONG_DRAWN * len(trials))
    return lines, missed


def table(judged, kinds):
    """Confusion: what the plant had against what was said; equal answers counted."""
    lines = ["## What was said", "", "`a | b, c`: effect a named, then a class of b and c. In front: how often.", "",
             "| plant | kind | trials | right | a wrong name | answers |", "| --- | --- | ---: | ---: | ---: | --- |"]
    for name, trials in judged.items():
        answers = collections.Counter(t[2] for t in trials).most_common()
        words = "; ".join(f"{n} × {a}".replace("|", "\\|") for a, n in answers)
        lines.append(f"| `{name}` | {kinds[name]} | {len(trials)} | {sum(t[0] == 'right' for t in trials)} | {sum(t[1] for t in trials)} | {words} |")
    return lines
