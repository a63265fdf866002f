"""Counts every test behind a ctest run and lists what failed or was skipped, with the reason.

    scripts/test_summary.py CASES_FOLDER CTEST_JUNIT CTEST_JSON

CASES_FOLDER holds the XML that GoogleTest programs wrote, a file a program; CTEST_JUNIT is what `ctest --output-junit` wrote, CTEST_JSON what
`ctest --show-only=json-v1` printed, which has the label that rl_test() gives to GoogleTest programs (cmake/testing.cmake). Such a program counts by its cases; one that ended badly without a failed case (crash, time-out) or ran no case counts as one failure. Every other
entry of ctest (Python, scripts) counts as one test. The last line is 'N passed, N failed, N skipped'; exit 1 when a test failed or none ran.
"""
import json
import pathlib
import re
import sys
import xml.etree.ElementTree as ET

GOOGLETEST_LABEL = "googletest"
LONGEST = 10


def reason_of(text):
    lines = [line.strip() for line in (text or "").splitlines() if line.strip()]
    said = [line for line in lines if line.startswith("skipped")]
    return (said or lines or ["no reason given"])[-1]


def googletest_cases(path):
    """[(name, "passed" | "failed" | "skipped", reason)] of one XML file; an unreadable file is a failure."""
    try:
        root = ET.parse(path).getroot()
    except ET.ParseError as error:
        return [(f"{path.stem}: its XML cannot be read", "failed", str(error))]
    found = []
    for case in root.iter("testcase"):
        name = f"{path.stem}: {case.get('classname')}.{case.get('name')}"
        skipped = case.find("skipped")
        if case.get("status") == "notrun":
            continue
        if case.find("failure") is not None:
            found.append((name, "failed", reason_of(case.find("failure").get("message"))))
        elif skipped is not None or case.get("result") == "skipped":
            found.append((name, "skipped", reason_of(skipped.get("message") or skipped.text if skipped is not None else "")))
        else:
            found.append((name, "passed", ""))
    return found


def googletest_programs(listing):
    """{name of the ctest entry: name of its program} of those with the label of GoogleTest programs."""
    found = {}
    for test in listing["tests"]:
        labels = next((p["value"] for p in test.get("properties", []) if p["name"] == "LABELS"), [])
        if GOOGLETEST_LABEL in labels:
            found[test["name"]] = pathlib.Path(test["command"][0]).name if test.get("command") else test["name"]
    return found


def outcome_of(entry):
    """A program that was not built is no skip."""
    status, skipped = entry.get("status"), entry.find("skipped")
    if status == "run":
        return "passed"
    if status == "disabled" or (status == "notrun" and skipped is not None and (skipped.get("message") or "").startswith("SKIP_")):
        return "skipped"
    return "failed"


def count(cases, entries, programs):
    """All results: `cases` are those of GoogleTest's XML, `entries` the testcase elements of ctest's JUnit file."""
    results = list(cases)
    for entry in entries:
        name, outcome = entry.get("name"), outcome_of(entry)
        if name not in programs:
            results.append((name, outcome, reason_of(entry.findtext("system-out"))))
            continue
        own = [c for c in cases if re.fullmatch(re.escape(programs[name]) + r"(_\d+)?", c[0].split(": ")[0])]  # GoogleTest numbers further files
        if outcome == "failed" and not any(c[1] == "failed" for c in own):
            results.append((name, "failed", "the program ended badly without a failed case: a crash, a time-out, or it was not built"))
        elif outcome == "passed" and not own:
            results.append((name, "failed", "the program ran no test"))
        elif outcome == "skipped":
            results.append((name, "skipped", reason_of(entry.findtext("system-out"))))
    return results


def main(cases_folder, junit, listing):
    cases = [case for path in sorted(pathlib.Path(cases_folder).glob("*.xml")) for case in googletest_cases(path)]
    entries = list(ET.parse(junit).getroot().iter("testcase"))
    results = count(cases, entries, googletest_programs(json.loads(pathlib.Path(listing).read_text())))
    for outcome in ("skipped", "failed"):
        for name, _, reason in (r for r in results if r[1] == outcome):
            print(f"{outcome}  {name}: {reason}")
    longest = sorted(entries, key=lambda e: -float(e.get("time") or 0))[:LONGEST]
    print("longest: " + ", ".join(f"{e.get('name')} {float(e.get('time') or 0):.0f} s" for e in longest))
    numbers = {outcome: sum(r[1] == outcome for r in results) for outcome in ("passed", "failed", "skipped")}
    print(f"{numbers['passed']} passed, {numbers['failed']} failed, {numbers['skipped']} skipped")
    return 0 if numbers["failed"] == 0 and numbers["passed"] > 0 else 1


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
