"""Counts the single tests behind a ctest run (GoogleTest XML in build/junit/cases) and lists what was skipped and why.
Called by scripts/check; the last line is 'N passed, N failed, N skipped'. Exit 1 when a test failed or none ran."""
import pathlib
import sys
import xml.etree.ElementTree as ET

passed = failed = 0
skipped = []
for path in sorted(pathlib.Path(sys.argv[1]).glob("*.xml")):
    for case in ET.parse(path).getroot().iter("testcase"):
        name = f"{path.stem}: {case.get('classname')}.{case.get('name')}"
        if case.get("status") == "notrun":
            continue
        if case.find("failure") is not None:
            failed += 1
        elif case.get("result") == "skipped" or case.find("skipped") is not None:
            node = case.find("skipped")
            reason = (node.get("message") or node.text or "") if node is not None else ""
            skipped.append(f"{name}: {reason.strip().splitlines()[-1] if reason.strip() else 'no reason given'}")
        else:
            passed += 1
for line in skipped:
    print("skipped  " + line)
print(f"{passed} passed, {failed} failed, {len(skipped)} skipped")
sys.exit(0 if failed == 0 and passed > 0 else 1)
