"""What scripts/diagnose_rules.py reads from the scores of a study: misses and false alarms of a number, and which trials a rule saves."""

import pathlib
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
import diagnose_rules as rules  # noqa: E402


def candidate(name, p_holm=1e-6, wald=50.0, size=1.0, gain=100.0, cross_validated=80.0, reason=None, **other):
    return {"id": name, "degrees": 1, "p_holm": p_holm, "wald": wald, "relative_size": size, "gain": gain, "bic": gain - 5.0, "inside_bounds": True,
            "cross_validated": cross_validated, "delta_log_likelihood": 0.0, "optimism": None, "variation": 0.0, "reason": reason, **other}


def trial(case, truth, answer, *rounds, kind="separable", axes=()):
    return {"case": case, "seed": 1, "kind": kind, "truth": truth, "answer": answer, "outcome": "right", "axes": list(axes), "rejected": [],
            "rounds": [{"placebo_wald": 12.0, "decision": "", "candidates": list(r)} for r in rounds]}


class Rules(unittest.TestCase):
    def setUp(self):
        self.numbers = {**rules.numbers(), "chance": 0.01, "torque_matters": 0.002}

    def test_the_header_has_twelve_numbers(self):
        self.assertEqual(len(self.numbers), 12, sorted(self.numbers))
        self.assertEqual(self.numbers["fewest_u"], 3.3)

    def test_a_stricter_chance_misses_what_is_there_and_a_looser_one_lets_pass_what_is_not(self):
        there = trial("a", ["a"], [["a"]], [candidate("a", p_holm=0.004)], [candidate("b", p_holm=0.03)])
        rows = rules.screening_curve([there], "chance", ("chance",), self.numbers)
        self.assertEqual(rows[0][1:], ("1 of 1", "0 of 1"))   # 0.0025
        self.assertEqual(rows[2][1:], ("0 of 1", "0 of 1"))   # 0.01
        self.assertEqual(rows[4][1:], ("0 of 1", "1 of 1"))   # 0.04

    def test_a_rule_saves_the_trial_in_which_it_alone_keeps_out_what_is_not_there(self):
        clean = trial("clean", [], [], [candidate("c", cross_validated=-1.0), candidate("d", cross_validated=-1.0, size=0.1)], kind="clean_full")
        saved = rules.saved([clean], self.numbers)
        self.assertEqual(saved["not_cross_validated"], {"absent": ["clean 1"], "present": []})
        self.assertNotIn("too_small", saved)  # d is kept out by two rules

    def test_a_foreign_torque_of_4_mN_m_remains_where_1_7_matter(self):
        left = {"axis": "torque x", "kind": "bursts", "rms": 0.005, "rms_expected": 0.003}
        rows = rules.residual_curve([trial("f", [], [], [], kind="foreign", axes=[left])], "torque_matters", "torque", 0.83, self.numbers)
        self.assertEqual([r[1] for r in rows], ["0 of 1 foreign"] * 3 + ["0 of 1 foreign", "1 of 1 foreign"])


if __name__ == "__main__":
    unittest.main()
