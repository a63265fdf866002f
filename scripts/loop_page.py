"""One page of a diagnosis of measured flights, from its result.json alone: residual, candidates, chosen effects, held-out error before and
after, what is left. `scripts/measured --loop PART` writes docs/acceptance/loop_PART.md with it; no figure is put in by hand."""

AXES = ["force x", "force y", "force z", "torque x", "torque y", "torque z"]
UNITS = ["N"] * 3 + ["N m"] * 3
LISTED = 8  # candidates of each round


def number(x, digits=3):
    return "–" if x is None else f"{x:.{digits}g}"


def cell(text):
    """In one line, for messages of the program have several, and without the sign that ends a cell."""
    return " ".join(text.split()).replace("|", "/")


def table(heads, rows):
    rows = [[cell(c) for c in r] for r in rows]
    return ["| " + " | ".join(heads) + " |", "|" + " --- |" * len(heads), *("| " + " | ".join(r) + " |" for r in rows), ""]


def sizes(parameters):
    return ", ".join(f"{p['name']} {number(p['value'], 4)} ± {number(p['u'], 2)} {p['unit']}" for p in parameters)


def wrench_rows(wrench):
    """The last score of each list is that of all flights in one pot."""
    kinds = ["before", "after", "before_aligned", "after_aligned"]
    last = {k: wrench[k][-1] if wrench.get(k) else None for k in kinds}
    rows = []
    for i, axis in enumerate(AXES):
        cells = [number(last[k]["rms"][i]) for k in kinds[:2]] + [UNITS[i]]
        cells += [number(last[k]["explained"][i]) if last[k] else "–" for k in kinds]
        rows.append([axis, *cells])
    return rows


def candidates(rounds):
    out = []
    for k, r in enumerate(rounds):
        out += [f"**Round {k + 1}**: {r['decision']}. {r['placebos']} placebos stay below a Wald F of {number(r['placebo_wald'])}.", ""]
        rows = [[f"`{c['id']}`", sizes(c["one_step"]) or "–", number(c["wald"]), number(c["p_holm"], 2), number(c["gain"]), number(c["cross_validated"]),
                 number(c["delta_log_likelihood"]) if c["delta_log_likelihood"] else "–", c["ruled_out_by"] or "stands"] for c in r["candidates"][:LISTED]]
        out += table(["effect", "size in one step", "Wald F", "p (Holm)", "Δ log-likelihood", "cross-validated", "by the refit", "ruled out by"], rows)
    return out


def chosen(result):
    if not result["added"]:
        return ["None.", ""]
    out = []
    for a in result["added"]:
        others = ", ".join(f"`{t['id']}`" for t in a["twins"])
        out.append(f"- `{a['id']}`: {sizes(a['parameters'])}" + (f"; indistinguishable from it: {others}" if others else "") + ".")
        out += [f"  Determined better than its own size: {r['name']} {number(r['value'], 4)} ± {number(r['u'], 2)}." for r in a["ratios"]]
    tried = [f"`{r['id']}` ({cell(r['ruled_out_by'])})" for r in result["rejected"]]
    return [*out, "", f"Refitted and not taken: {'; '.join(tried) if tried else 'none'}.", ""]


def errors(held):
    rows = [[r["quantity"].replace("_", " "), number(r["horizon_s"]), number(r["before"]), number(r["after"]), r["unit"],
             f"{number(r['ratio'])} ({number(r['low'])} to {number(r['high'])})", number(r["floor"])] for r in held["rows"]]
    return table(["error of", "horizon, s", "before", "after", "unit", "ratio (95 %)", "floor"], rows)


def left(result):
    out = [f"- {r['axis']}{' in ' + r['flight'] if r['flight'] else ''}: {number(r['beyond_noise_rms'])} {r['unit']} "
           + (f"({r['kind'].replace('_', ' ')}; {number(r['limit_rms'])} expected)." if r["kind"] in ("noise", "held_out") else
              f"beyond the noise figures ({number(r['limit_rms'])} matters), {100 * r['share']:.0f} % of its power "
              f"{'in bursts' if r['kind'] == 'bursts' else 'predictable'}.") for r in result["remains"]]
    out = out or ["- No axis of force or torque keeps a part that matters and is not noise."]
    return [*out, *(f"- {w}" for w in result["remarks"]), ""]


def page(name, command, provenance, result):
    held = result.get("held_out")
    log = result["log_likelihood"]
    lines = [f"# From residual to effects on measured flights: {name}", "",
             f"Written by `scripts/measured --loop {name}` from what the program said; the diagnosis alone:", "", "```", command, "```", "",
             f"Verdict: **{result['verdict']}**. {provenance} Log likelihood {log['before']:.1f} → {log['after']:.1f}.", ""]
    if held and "wrench" in held:
        w = held["wrench"]
        lines += [f"## Residual wrench of the {len(held['flights'])} flights held out, {number(w['from_Hz'])} to {number(w['to_Hz'])} Hz", "",
                  "*Before* is the residual that the search began with, *after* what the chosen effects leave; *aligned*: each flight's stamps moved by one delay.", ""]
        lines += table(["axis", "rms before", "after", "unit", "R² before", "after", "aligned before", "after"], wrench_rows(w))
    lines += ["## Candidates", "", *candidates(result["rounds"]), "## Chosen effects", "", *chosen(result)]
    if held:
        lines += ["## Open-loop error of the flights held out, before and after", "", *errors(held)]
        lines += [f"- {r}" for r in held["remarks"]] + ([""] if held["remarks"] else [])
    lines += ["## What is left", "", *left(result)]
    return "\n".join(lines).rstrip() + "\n"
