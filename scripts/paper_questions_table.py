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
INERTIAS = NAMES[:3]
LIMIT = {3: 7.81, 4: 9.49, 5: 11.07}  # chi² that 95 % stay below
HOVER_RAD_S, RADIUS_M, DENSITY_KG_M3 = 945.0, 0.0635, 1.2
SHOWN = 20  # of the levers
MARKS = ("<!-- scripts/stats paper-questions: begin -->", "<!-- scripts/stats paper-questions: end -->")


def static_c_t(k_1, k_2):
    """Of eq. 1-2 at rest and hover speed: T = k1 w² + k2 w v_i, T = 2 rho A v_i²."""
    momentum = 2.0 * DENSITY_KG_M3 * math.pi * RADIUS_M**2
    b, c = -k_2 * HOVER_RAD_S / momentum, -k_1 * HOVER_RAD_S**2 / momentum
    v_i = 0.5 * (-b + math.sqrt(b * b - 4.0 * c))
    return momentum * v_i**2 / HOVER_RAD_S**2


def errors(values, study, case=None):
    """Relative errors against the plant's truth, or against a CAD model that misses some of it; None where nothing was estimated."""
    missed = (case or {}).get("cad_misses", {})
    of = dict(values)
    if "k_1" in of and "k_2" in of:
        of["c_t"] = static_c_t(of["k_1"], of["k_2"])
    return {n: of[n] / (study["true"][n] - missed.get(n, 0.0)) - 1 if n in of else None for n in NAMES}


def chi2(e, names):
    if any(e[n] is None for n in names):
        return math.inf
    return sum(((e[n] - PAPER[n]) / PAPER_U[n]) ** 2 for n in names)


def levered(e):
    """The errors when roll and pitch torque are assumed too large by the factor that suits the paper's figures best, and that factor.

    Arms that are assumed too long do that, or a thrust that grows less with rotor speed than its square: all three inertias and c_q grow
    by the factor, as Euler's equations are homogeneous in inertia and torque, and I_zz is determined by its part in roll and pitch.
    """
    of = ("I_xx", "I_yy", "I_zz", "c_q")
    if any(e[n] is None for n in of):
        return e, 1.0
    s = sum((1 + e[n]) * (1 + PAPER[n]) / PAPER_U[n] ** 2 for n in of) / sum(((1 + e[n]) / PAPER_U[n]) ** 2 for n in of)
    return {n: (1 + e[n]) * s - 1 if n in of else e[n] for n in e}, s


def signs(e):
    """How many of the four have the paper's sign, by a point at least."""
    return sum(e[n] is not None and e[n] * math.copysign(1.0, PAPER[n]) > 0.01 for n in ASKED)


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


CHI2 = (INERTIAS, ASKED, NAMES)
HEAD = ("| case | what it stands for | seeds | I_xx | I_yy | I_zz | c_t | c_q | chi² of I | of I, c_t | of all | signs |\n|"
        + " --- |" * 12 + "\n")


def chi2_cells(e):
    """Bold where 95 % of the paper's own scatter reaches."""
    of = [(chi2(e, names), LIMIT[len(names)]) for names in CHI2]
    return " ".join(f"**{c:.1f}** |" if c < limit else f"{c:.1f} |" for c, limit in of)


def paper_row():
    limits = " ".join(f"95 %: {LIMIT[len(names)]} |" for names in CHI2)
    return "| **paper** | Table I | | " + " ".join(f"{100 * PAPER[n]:+.0f} ± {100 * PAPER_U[n]:.0f} |" for n in NAMES) + f" {limits} |\n"


def row(name, why, seeds, e):
    return f"| {name} | {why} | {seeds} | {cells(e)} {chi2_cells(e)} {signs(e)} of 4 |\n"


def way_tables(way, title, found, cases, study):
    of = {name: mean_errors(rs, way, study, cases[name]) for name, rs in found.items()}
    nearest = sorted(of, key=lambda n: chi2(of[n][0], ASKED))
    single, mixed = ([n for n in nearest if (cases[n]["group"] == "mix") == is_mix] for is_mix in (False, True))
    nominal = of["nominal"][0]
    shifts = {n: {k: of[n][0][k] - nominal[k] for k in NAMES} for n in single}
    text = f"\n### {title}: errors in %, nearest first\n\n" + HEAD + paper_row()
    for n in single:
        text += row(f"`{n}`", cases[n]["why"], len(found[n]), of[n][0])
    if mixed:
        text += f"\n### {title}: mixes, flown; below each what its parts add up to\n\n" + HEAD + paper_row()
    for n in mixed:
        text += row(f"`{n}`", cases[n]["why"], len(found[n]), of[n][0])
        if parts := summed(cases[n], shifts, nominal, cases):
            text += row("", "sum of " + ", ".join(f"`{p}`" for p in cases[n]["parts"]), "", parts)
    if way == "stages":
        text += (f"\n### {title}: each with the lever that suits it best\n\nNot flown: inertias and c_q times one factor, as arms that are assumed too long "
                 "by it make them. The factor is fitted: one figure less in each chi².\n\n" + HEAD.replace("seeds", "factor") + paper_row())
        best = {n: levered(of[n][0]) for n in of}
        for n in sorted(of, key=lambda n: chi2(best[n][0], (*INERTIAS, "c_q")))[:SHOWN]:
            text += row(f"`{n}`", cases[n]["why"], f"{best[n][1]:.2f}", best[n][0])
    widest = max(((s, n) for n, (_, s) in of.items() if len(found[n]) > 1), default=None)
    if widest:
        text += f"\nSeeds differ from their mean by {100 * widest[0]:.1f} points at most (`{widest[1]}`).\n"
    return text


def tables(out, study):
    cases = {c["name"]: c for c in study["case"]}
    found, failed = read(out, study)
    if "nominal" not in found:
        return "the case `nominal` has not been flown: nothing to compare with\n"
    text = "".join(way_tables(way, title, found, cases, study)
                   for way, title in (("stages", "As published: three stages"), ("joint", "One joint fit over the three flights")))
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
