"""The judge of scripts/stats paper-questions: relative errors of what was identified beside those of the paper's Table I, and the tables
of docs/acceptance/paper_questions.md between its marks."""

import json
import math

NAMES = ("I_xx", "I_yy", "I_zz", "c_t", "c_q")
# Table I, estimate over CAD or stand, less 1; for c_t flight over stand, which is 8 % higher. u: Table I's standard deviation over the
# truth; for c_t 3 %, of stand and flight together.
PAPER = {"I_xx": 0.270, "I_yy": 0.292, "I_zz": -0.155, "c_t": 1 / 1.08 - 1, "c_q": 0.160}
PAPER_U = {"I_xx": 0.071, "I_yy": 0.067, "I_zz": 0.059, "c_t": 0.03, "c_q": 0.167}
ASKED = NAMES[:4]  # the four figures of the question; c_q stands beside them
LIMIT = {4: 9.49, 5: 11.07}  # chi² that 95 % stay below
HOVER_RAD_S, RADIUS_M, DENSITY_KG_M3 = 945.0, 0.0635, 1.2
MARKS = ("<!-- scripts/stats paper-questions: begin -->", "<!-- scripts/stats paper-questions: end -->")


def static_c_t(k_1, k_2):
    """Of eq. 1-2 at rest and hover speed: T = k1 w² + k2 w v_i, T = 2 rho A v_i²."""
    momentum = 2.0 * DENSITY_KG_M3 * math.pi * RADIUS_M**2
    b, c = -k_2 * HOVER_RAD_S / momentum, -k_1 * HOVER_RAD_S**2 / momentum
    v_i = 0.5 * (-b + math.sqrt(b * b - 4.0 * c))
    return momentum * v_i**2 / HOVER_RAD_S**2


def errors(values, study, case=None):
    """Relative errors against the plant's truth, or against a CAD model that misses some of it; None where nothing was told."""
    missed = (case or {}).get("cad_misses", {})
    of = dict(values)
    if "k_1" in of and "k_2" in of:
        of["c_t"] = static_c_t(of["k_1"], of["k_2"])
    return {n: of[n] / (study["true"][n] - missed.get(n, 0.0)) - 1 if n in of else None for n in NAMES}


def chi2(e, names):
    if any(e[n] is None for n in names):
        return math.inf
    return sum(((e[n] - PAPER[n]) / PAPER_U[n]) ** 2 for n in names)


def signs(e):
    """How many of the four have the paper's sign."""
    return sum(e[n] is not None and e[n] * PAPER[n] > 0 for n in ASKED)


def cells(e):
    return " ".join(f"{100 * e[n]:+.0f} |" if e[n] is not None else "– |" for n in NAMES)


def in_words(record, study):
    case = next(c for c in study["case"] if c["name"] == record["case"])
    if "error" in record:
        return "no answer: " + record["error"].splitlines()[0] if record["error"] else "no answer"
    return "; ".join(f"{way}: {cells(errors(record[way], study, case))} chi2 {chi2(errors(record[way], study, case), ASKED):.1f}" for way in ("stages", "joint"))


def mean_errors(records, way, study, case):
    """Over seeds; and the largest distance of a seed from it."""
    of = [errors(r[way], study, case) for r in records]
    mean = {n: sum(e[n] for e in of) / len(of) if all(e[n] is not None for e in of) else None for n in NAMES}
    return mean, max((abs(e[n] - mean[n]) for e in of for n in NAMES if mean[n] is not None), default=0.0)


def read(out, study):
    """{case: [records]} with an answer, and [(case, why)] without."""
    found, failed = {}, []
    for case in study["case"]:
        for file in sorted((out / case.get("same_as", case["name"])).glob("*.json")):
            r = json.loads(file.read_text(encoding="utf-8"))
            if "error" in r or any(end != "completed" for end in r["ends"].values()):
                failed.append((case["name"], r["seed"], r.get("error") or ", ".join(f"{k} {v}" for k, v in r["ends"].items())))
            else:
                found.setdefault(case["name"], []).append(r)
    return found, failed


def summed(case, shifts, nominal, cases):
    """What the parts of a mix would do one on top of the other: the nominal plant's errors and each part's own shift."""
    parts = [cases[p] for p in case["parts"]]
    if any(p["name"] not in shifts for p in parts):
        return None
    return {n: nominal[n] + sum(shifts[p["name"]][n] for p in parts) for n in NAMES}


HEAD = "| case | what it stands for | seeds | I_xx | I_yy | I_zz | c_t | c_q | chi² of 4 | of 5 | signs |\n|" + " --- |" * 11 + "\n"


def paper_row():
    return "| **paper** | Table I | | " + " ".join(f"{100 * PAPER[n]:+.0f} ± {100 * PAPER_U[n]:.0f} |" for n in NAMES) + " | | |\n"


def row(case, e, seeds, mark=""):
    return (f"| `{case['name']}`{mark} | {case['why']} | {seeds} | {cells(e)} {chi2(e, ASKED):.1f} | {chi2(e, NAMES):.1f} | {signs(e)} of 4 |\n")


def tables(out, study):
    cases = {c["name"]: c for c in study["case"]}
    found, failed = read(out, study)
    if "nominal" not in found:
        return "the case `nominal` has not been flown: nothing to compare with\n"
    text = ""
    for way, title in (("stages", "As published: three stages"), ("joint", "One joint fit over the three flights")):
        of = {name: mean_errors(rs, way, study, cases[name]) for name, rs in found.items()}
        nominal = of["nominal"][0]
        single = sorted((n for n in of if cases[n]["group"] != "mix"), key=lambda n: chi2(of[n][0], ASKED))
        mixed = sorted((n for n in of if cases[n]["group"] == "mix"), key=lambda n: chi2(of[n][0], ASKED))
        shifts = {n: {k: of[n][0][k] - nominal[k] for k in NAMES} for n in single}
        text += f"\n### {title}: errors in %, nearest first\n\n" + HEAD + paper_row()
        for n in single:
            text += row(cases[n], of[n][0], len(found[n]))
        if mixed:
            text += f"\n### {title}: mixes, flown; below each what its parts alone add up to\n\n" + HEAD + paper_row()
        for n in mixed:
            text += row(cases[n], of[n][0], len(found[n]))
            sum_of_parts = summed(cases[n], shifts, nominal, cases)
            if sum_of_parts:
                text += "| | sum of " + ", ".join(f"`{p}`" for p in cases[n]["parts"]) + f" | | {cells(sum_of_parts)} {chi2(sum_of_parts, ASKED):.1f} | {chi2(sum_of_parts, NAMES):.1f} | |\n"
        widest = max(((s, n) for n, (_, s) in of.items() if len(found[n]) > 1), default=None)
        if widest:
            text += f"\nSeeds differ from their mean by {100 * widest[0]:.1f} points at most (`{widest[1]}`).\n"
    if failed:
        text += "\nWithout an answer:\n\n" + "".join(f"- `{n}`, seed {s}: {' '.join(why.split())}\n" for n, s, why in failed)
    return text


def write(page, text):
    """Between the marks of the page, and nowhere else."""
    old = page.read_text(encoding="utf-8")
    before, _, rest = old.partition(MARKS[0])
    _, found, after = rest.partition(MARKS[1])
    if not found:
        raise SystemExit(f"error: {page} has no marks\n  do: put '{MARKS[0]}' and '{MARKS[1]}' where the tables belong")
    page.write_text(before + MARKS[0] + "\n" + text + "\n" + MARKS[1] + after, encoding="utf-8")
