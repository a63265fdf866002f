#!/usr/bin/env python3
"""What the numbers of bench/sysid/diagnose/decision_rules.hpp decide in the trials of a study: scripts/diagnose_rules.py FOLDER...

FOLDER: as scripts/stats diagnose leaves it (--out). Every score on which a rule decides stands in a trial's result.json; --scores FILE writes
those of all trials into one. Prints for each number, over a range of its values, in how many trials the effect that is there would be missed by
that number alone and in how many an effect that is not there would pass (all other rules as they are), and for each rule of the search the trials in which it
keeps out something that is not there, or what is. Only trials with a result count. One step of a search is looked at, not what would follow from another choice.
"""

import argparse
import collections
import json
import math
import pathlib
import sys
import tomllib

import diagnose_score as score

ROOT = pathlib.Path(__file__).resolve().parent.parent
RULES = ROOT / "bench/sysid/diagnose/decision_rules.hpp"


def numbers():
    """Names and values of the struct, as the header has them."""
    import re
    out = {}
    for line in RULES.read_text(encoding="utf-8").split("struct Criteria {")[1].split("};")[0].splitlines():
        if line.strip().startswith("//"):
            continue
        for name, value in re.findall(r"(\w+) = ([0-9.]+)", line.split("//")[0]):
            out[name] = float(value)
    return out


def scores_of(folder):
    """The scores of one trial, or None."""
    both = score.read(folder)
    if both is None or "rounds" not in both[1]:
        return None
    trial, result = both
    kept = ("id", "chi2", "wald", "degrees", "p_holm", "gain", "bic", "cross_validated", "delta_log_likelihood", "optimism", "relative_size", "variation",
            "scatter", "inside_bounds", "reason")
    axes = result.get("residuals", {}).get("axes", [])
    judged, wrong = score.outcome(trial, result)
    return {
        "case": trial["case"], "kind": trial["kind"], "truth": trial["truth"], "seed": trial["seed"], "wall_s": trial["wall_s"], "cpu_s": trial.get("cpu_s"),
        "verdict": result["verdict"], "outcome": judged, "wrong": wrong, "answer": score.answer_sets(result),
        "rounds": [{"placebo_wald": r["placebo_wald"], "decision": r["decision"],
                    "candidates": [{k: c.get(k) for k in kept} for c in r["candidates"]]} for r in result["rounds"]],
        "rejected": [{k: c.get(k) for k in kept} for c in result["rejected"]],
        "axes": [{k: a[k] for k in ("axis", "kind", "rms", "rms_expected", "explainable_share", "explainable_by_chance", "burst_share")} for a in axes],
    }


SCREENING = {  # rule -> whether a candidate passes it, given the numbers and the round's limit of the placebos
    "chance": lambda c, n, limit: c["p_holm"] <= n["chance"],
    "placebos": lambda c, n, limit: c["wald"] >= (limit or 0.0),
    "out_of_range": lambda c, n, limit: c["inside_bounds"],
    "too_small": lambda c, n, limit: (c["relative_size"] if c["relative_size"] is not None else 1.0) >= n["relevant"],
    "costs_more": lambda c, n, limit: c["bic"] > 0.0,
    "not_cross_validated": lambda c, n, limit: c["cross_validated"] >= n["negligible"] * c["gain"],
}


def passes(c, n, limit, but=()):
    return c["degrees"] > 0 and all(rule(c, n, limit) for name, rule in SCREENING.items() if name not in but)


def absent_in(t):
    """Candidates of the last round that stand for nothing there, where the effects that are there are in the model."""
    last = t["rounds"][-1]
    if set(t["truth"]) - {i for s in t["answer"] for i in s}:
        return [], last
    return [c for c in last["candidates"] if c["id"] not in t["truth"]], last


def present_in(t):
    """The first round's evidence of the first effect that is there."""
    first = t["rounds"][0]
    return next((c for c in first["candidates"] if c["id"] in t["truth"]), None), first


def screening_curve(trials, number, rules, n, factors=(0.25, 0.5, 1.0, 2.0, 4.0)):
    rows = []
    for f in factors:
        other = {**n, number: n[number] * f}
        known = [(c, r) for c, r in map(present_in, trials) if c and c["degrees"] > 0]
        missed = sum(not all(SCREENING[k](c, other, r["placebo_wald"]) for k in rules) for c, r in known)
        alarms = sum(any(passes(c, other, r["placebo_wald"]) for c in absent) for absent, r in map(absent_in, trials))
        rows.append((other[number], f"{missed} of {len(known)}", f"{alarms} of {len(trials)}"))
    return rows


def residual_curve(trials, number, axes, per_unit, n):
    """`per_unit`: the residual that the number 1 stands for."""
    def beyond(t):
        return max((math.sqrt(max(0.0, a["rms"] ** 2 - a["rms_expected"] ** 2)) / per_unit for a in t["axes"]
                    if a["axis"].startswith(axes) and a["kind"] in ("systematic", "bursts")), default=0.0)
    foreign = [t for t in trials if t["kind"] == "foreign"]
    right = [t for t in trials if t["kind"] != "foreign" and t["outcome"] == "right"]
    return [(n[number] * f, f"{sum(beyond(t) <= n[number] * f for t in foreign)} of {len(foreign)} foreign",
             f"{sum(beyond(t) > n[number] * f for t in right)} of {len(right)} right") for f in (0.25, 0.5, 1.0, 2.0, 4.0)]


def variation_curve(trials, n):
    accepted = [c for t in trials for s in [t] for r in s["rounds"] for c in r["candidates"]
                if c["id"] in t["truth"] and c["delta_log_likelihood"] and r["decision"] == f"added {c['id']}"]
    others = [c for t in trials for c in t["rejected"] if c["id"] not in t["truth"] and c["variation"] and c["delta_log_likelihood"]]
    return [(v, f"{sum(c['variation'] > v for c in accepted)} of {len(accepted)} accepted", f"{sum(c['variation'] <= v for c in others)} of {len(others)} refitted and absent")
            for v in (0.2, 0.3, 0.4, 0.5, 0.6, 0.8)]


def saved(trials, n):
    """rule -> {"absent": trials in which it alone keeps out what is not there, "present": … what is there}"""
    out = collections.defaultdict(lambda: {"absent": [], "present": []})
    for t in trials:
        name = f"{t['case']} {t['seed']}"
        for r in t["rounds"]:
            for c in r["candidates"]:
                for rule in SCREENING:
                    if c["degrees"] > 0 and not SCREENING[rule](c, n, r["placebo_wald"]) and passes(c, n, r["placebo_wald"], (rule,)):
                        out[rule]["present" if c["id"] in t["truth"] else "absent"].append(name)
                if c["reason"] and c["reason"]["id"] not in SCREENING and c["reason"]["id"] not in ("absorbed", "not_refitted"):
                    out[c["reason"]["id"]]["present" if c["id"] in t["truth"] else "absent"].append(name)
    return {rule: {k: sorted(set(v)) for k, v in both.items()} for rule, both in out.items()}


def predictive(trials):
    """Rankings of each round's refits by the rise of the log likelihood and by what of it is left on other stretches."""
    compared, changed = 0, []
    for t in trials:
        for r in t["rounds"]:
            refits = [c for c in r["candidates"] if c["delta_log_likelihood"] and c["optimism"] is not None and not c["reason"]]
            if len(refits) < 2:
                continue
            compared += 1
            by_rise = max(refits, key=lambda c: c["delta_log_likelihood"])
            by_prediction = max(refits, key=lambda c: c["delta_log_likelihood"] - c["optimism"])
            if by_rise["id"] != by_prediction["id"]:
                changed.append(f"{t['case']} {t['seed']}: {by_rise['id']} by rise, {by_prediction['id']} by prediction")
    return compared, changed


def table(head, rows):
    return "\n".join(["| " + " | ".join(head) + " |", "| " + " | ".join("---" for _ in head) + " |",
                      *("| " + " | ".join(f"{x:.3g}" if isinstance(x, float) else str(x) for x in row) + " |" for row in rows)])


def page(trials, n, vehicle):
    mass_kg = vehicle["body"]["mass_kg"]
    weight_N = 9.80665 * (mass_kg["value"] if isinstance(mass_kg, dict) else mass_kg)
    arm_m = sum(math.hypot(*r["position_m"][:2]) for r in vehicle["rotor"]) / len(vehicle["rotor"])
    out = [f"{len(trials)} trials.\n"]
    for number, rules in (("chance", ("chance",)), ("relevant", ("too_small",)), ("negligible", ("not_cross_validated",))):
        out += [f"**{number}** ({', '.join(rules)})\n", table(("value", "would be missed", "would be named though absent"), screening_curve(trials, number, rules, n)), ""]
    for number, axes, unit in (("force_matters", "force", weight_N), ("torque_matters", "torque", weight_N * arm_m)):
        out += [f"**{number}**\n", table(("value", "nothing remains", "something remains"), residual_curve(trials, number, axes, unit, n)), ""]
    out += ["**larger_part** as the limit of an effect's variation\n", table(("value", "beyond it", "within it"), variation_curve(trials, n)), "",
            "**What each rule keeps out**\n"]
    out.append(table(("rule", "absent", "present", "trials (absent)", "trials (present)"),
                     [(rule, len(v["absent"]), len(v["present"]), ", ".join(v["absent"][:6]) + (" …" if len(v["absent"]) > 6 else ""), ", ".join(v["present"]))
                      for rule, v in sorted(saved(trials, n).items())]))
    compared, changed = predictive(trials)
    out += ["", f"**Predicted log likelihood**: {compared} rounds with two refits or more; {len(changed)} would put another first.", *(f"- {c}" for c in changed)]
    return "\n".join(out)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=pathlib.Path)
    parser.add_argument("--vehicle", type=pathlib.Path, default=ROOT / "vehicles/hil_baseline.toml", help="whose weight and arm the residuals are over")
    parser.add_argument("--scores", type=pathlib.Path, help="all scores, as JSON")
    o = parser.parse_args()
    found = [scores_of(p.parent) for f in o.folders for p in sorted(f.glob("*/*/trial.json"))]
    trials = [t for t in found if t]
    if not trials:
        sys.exit(f"error: no finished trial below {', '.join(map(str, o.folders))}\n  do: name a folder of scripts/stats diagnose (--out)")
    if o.scores:
        o.scores.write_text(json.dumps(trials) + "\n", encoding="utf-8")
    print(page(trials, numbers(), tomllib.loads(o.vehicle.read_text(encoding="utf-8"))))


if __name__ == "__main__":
    main()
