"""The judge of scripts/stats diagnose: which answer to which plant counts as what."""

import dataclasses
import json
import math
import pathlib
import sys
import tempfile
import types
import unittest
import unittest.mock

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))
import diagnose_compare as compare  # noqa: E402
import diagnose_score as score  # noqa: E402
import diagnose_study as study  # noqa: E402


def trial(kind, *truth):
    return {"kind": kind, "truth": list(truth)}


def said(verdict, *sets, manoeuvre="fly it", not_observable=()):
    """An answer: each set is an effect and those indistinguishable from it."""
    return {"verdict": verdict,
            "added": [{"id": s[0], "twins": [{"id": t} for t in s[1:]], "manoeuvre": manoeuvre} for s in sets],
            "not_observable": [{"id": i} for i in not_observable]}


class Judge(unittest.TestCase):
    def expect(self, outcome, wrong, kind, truth, answer):
        self.assertEqual(score.outcome(trial(kind, *truth), answer), (outcome, wrong))

    def test_separable_must_be_named_first_and_alone(self):
        for outcome, wrong, answer in [
            ("right", False, said("named", ["a"])),
            ("right", True, said("named", ["a"], ["b"])),
            ("inside", False, said("ambiguous", ["a", "b"])),
            ("inside", True, said("named", ["b"], ["a"])),
            ("wrong", True, said("named", ["b"])),
            ("missed", False, said("clean")),
            ("missed", False, said("unexplained")),
        ]:
            self.expect(outcome, wrong, "separable", ["a"], answer)

    def test_class_of_up_to_three_with_the_manoeuvre_that_tells(self):
        for outcome, wrong, answer in [
            ("right", False, said("ambiguous", ["b", "a", "c"])),
            ("right", False, said("named", ["a"], manoeuvre="")),
            ("inside", False, said("ambiguous", ["b", "a"], manoeuvre="")),
            ("inside", False, said("ambiguous", ["b", "a", "c", "d"])),
            ("wrong", True, said("ambiguous", ["b", "c"])),
        ]:
            self.expect(outcome, wrong, "class_only", ["a"], answer)

    def test_not_observable_must_be_said_and_nothing_named(self):
        self.expect("right", False, "not_observable", ["a"], said("clean", not_observable=["a"]))
        self.expect("silent", False, "not_observable", ["a"], said("clean"))
        self.expect("wrong", True, "not_observable", ["a"], said("named", ["b"], not_observable=["a"]))

    def test_both_of_two(self):
        self.expect("right", False, "pair", ["a", "b"], said("ambiguous", ["b"], ["a", "c"]))
        self.expect("half", True, "pair", ["a", "b"], said("named", ["b"], ["c"]))

    def test_a_name_for_what_no_library_knows_is_wrong(self):
        self.expect("right", False, "foreign", [], said("unexplained"))
        self.expect("wrong", True, "foreign", [], said("unexplained", ["b"]))
        self.expect("missed", False, "foreign", [], said("clean"))
        self.expect("wrong", True, "clean_full", [], said("named", ["b"]))
        self.expect("false alarm", False, "clean_full", [], said("unexplained"))
        self.expect("right", False, "clean_reduced", [], said("clean"))

    def test_an_error_of_a_sensor_is_the_only_answer_or_in_a_class_of_three(self):
        self.expect("right", False, "sensor", ["a"], said("ambiguous", ["b", "a"]))
        self.expect("half", True, "sensor", ["a"], said("named", ["a"], ["b"]))
        self.expect("half", False, "sensor", ["a"], said("unexplained", ["a"], ["b"]))
        self.expect("half", False, "sensor_pair", ["a", "b"], said("named", ["b"]))
        self.expect("right", False, "sensor_pair", ["a", "b"], said("named", ["b"], ["a"]))

    def test_what_was_done_to_a_log_must_be_said_by_the_checks(self):
        done = {**trial("log_error"), "says": "end of its range"}
        noted = {**said("clean"), "left_out": [{"what": "7 samples at the end of its range"}]}
        self.assertEqual(score.outcome(done, noted), ("right", False))
        self.assertEqual(score.outcome(done, said("clean")), ("missed", False))
        self.assertEqual(score.outcome(done, {**noted, **said("named", ["a"])}), ("wrong", True))

    def test_foreign_physics_of_a_part_of_the_flights_is_unexplained_whatever_is_named_under_that_reserve(self):
        self.expect("right", False, "foreign_part", [], said("unexplained", ["b"]))
        self.expect("wrong", True, "foreign_part", [], said("named", ["b"]))
        self.expect("missed", False, "foreign_part", [], said("clean"))

    def test_foreign_physics_of_a_part_prints_both_shares_unexplained_and_nothing_named(self):
        judged = {"a": [("right", False, "unexplained", 1), ("right", False, "b", 2), ("missed", False, "clean", 3), ("right", False, "unexplained", 4)]}
        text = "\n".join(score.summary(judged, {"a": "foreign_part"})[0])
        self.assertRegex(text, r"by a product: unexplained \| 75.0 % \(3 of 4;")
        self.assertRegex(text, r"nothing named under that reserve \| 50.0 % \(2 of 4;")

    def test_page_misses_a_limit_by_one_trial_and_names_the_effect_below_seven_of_ten(self):
        with tempfile.TemporaryDirectory() as name:
            out = pathlib.Path(name)
            for seed in range(10):
                folder = out / "a" / str(seed)
                folder.mkdir(parents=True)
                record = {**trial("separable", "a"), "seed": seed, "ends": {"vertical": "completed"}, "exit": 0, "wall_s": 1.0}
                (folder / "trial.json").write_text(json.dumps(record))
                (folder / "result.json").write_text(json.dumps(said("named", ["a"] if seed < 6 else ["b"])))
            page, missed = score.page(out, [types.SimpleNamespace(name="a", kind="separable", blade_level=False)])
            self.assertTrue(missed)
            self.assertIn("60.0 % (6 of 10", page)
            self.assertIn("| single effects below 7 of 10 | 1 of 1 | 0 | **missed** |", page)
            self.assertIn("6 × a; 4 × b", page)

    def test_plants_of_blade_elements_are_counted_apart_from_those_of_the_models_own_form(self):
        judged = {"a": [("right", False, "a", 1)], "b": [("missed", False, "clean", 1), ("right", False, "b", 2)]}
        rows, _ = score.summary(judged, {"a": "separable", "b": "separable"}, {"b"})
        text = "\n".join(rows)
        self.assertRegex(text, r"plant of model's own form \| 100.0 % \(1 of 1;")
        self.assertRegex(text, r"plant of blade elements and wakes \| 50.0 % \(1 of 2;")


class TwoPrograms(unittest.TestCase):
    """The same trials by two programs: what changed, and whether that is worse."""

    @staticmethod
    def folder(out, answers):
        for seed, answer in enumerate(answers):
            folder = pathlib.Path(out) / "a" / str(seed)
            folder.mkdir(parents=True)
            record = {**trial("separable", "a"), "case": "a", "seed": seed, "ends": {}, "exit": 0, "wall_s": 1.0}
            (folder / "trial.json").write_text(json.dumps(record))
            (folder / "result.json").write_text(json.dumps(answer))
        return compare.trials(out)

    def compared(self, old, new):
        with tempfile.TemporaryDirectory() as a, tempfile.TemporaryDirectory() as b:
            return compare.compare(self.folder(a, old), self.folder(b, new))

    def test_exact_two_sided_probability_of_a_split(self):
        self.assertEqual(compare.by_chance(0, 0), 1.0)
        self.assertEqual(compare.by_chance(3, 3), 1.0)
        self.assertAlmostEqual(compare.by_chance(0, 6), 2.0 / 64.0)
        self.assertAlmostEqual(compare.by_chance(8, 1), 20.0 / 512.0)

    def test_one_trial_lost_is_chance_and_two_of_ten_are_not(self):
        right, missed = said("named", ["a"]), said("clean")
        page, lost = self.compared([right] * 10, [missed] + [right] * 9)
        self.assertFalse(lost)
        self.assertIn("- `a` seed 0: right: a -> missed: clean", page)
        self.assertTrue(self.compared([right] * 10, [missed] * 2 + [right] * 8)[1])
        self.assertFalse(self.compared([missed] * 2 + [right] * 8, [right] * 10)[1])

    def test_a_wrong_name_more_than_before_is_a_loss(self):
        self.assertTrue(self.compared([said("named", ["a"])], [said("named", ["a"], ["b"])])[1])

    def test_trials_of_one_folder_alone_are_left_out(self):
        page, lost = self.compared([said("clean")] * 5, [said("clean")] * 2)
        self.assertFalse(lost)
        self.assertIn("2 trials in both; a wrong name in 0 before, 0 now.", page)


class Plants(unittest.TestCase):
    """Every case of the study is a plant that the vehicle file does not know, made from the files as they are."""

    def setUp(self):
        self.study, self.catalogue = study.toml(study.STUDY), study.toml(ROOT / "effects/catalogue.toml")
        self.cases = {c.name: c for c in study.cases(self.study, self.catalogue)}

    def test_every_effect_of_the_plant_is_a_case_and_changes_plant_or_model(self):
        for e in self.catalogue["effect"]:
            if e["plant"]:
                c = self.cases[e["id"]]
                self.assertTrue(c.entries or c.unmodelled, c.name)

    def test_plant_files_hold_what_the_case_says(self):
        for c in self.cases.values():
            ids = [e["id"] for e in study.tomllib.loads(study.plant_text(c.entries, self.study)).get("effect", [])]
            self.assertEqual(len(ids), len(set(ids)), c.name)
            for i, _ in c.entries:
                self.assertIn(i, ids)

    def test_nominal_model_loses_the_term_and_its_rows_of_the_covariance(self):
        with tempfile.TemporaryDirectory() as name:
            for c in self.cases.values():
                if not c.unmodelled:
                    continue
                path = pathlib.Path(name) / "nominal.toml"
                study.write_nominal(path, c, ROOT / self.study["vehicle"])
                nominal = study.toml(path)
                for i in c.unmodelled:
                    self.assertNotIn(i, [e["id"] for e in nominal.get("effect", [])])
                for block in nominal.get("covariance", []):
                    self.assertEqual(len(block["matrix"]), len(block["of"]) ** 2)
                    self.assertFalse([n for n in block["of"] if n.split(".")[1] in c.unmodelled and n.startswith("effect.")])

    def test_drawn_sizes_lie_in_their_ranges_and_stay_for_a_seed(self):
        drawn = {c.name: c for c in study.cases(self.study, self.catalogue, study.toml(study.SENSORS))}
        for seed in range(801, 821):
            self.assertEqual(study.sensors.entries(drawn["gyro_scale"], seed), study.sensors.entries(drawn["gyro_scale"], seed))
            ((_, gyro),) = study.sensors.entries(drawn["gyro_scale"], seed)
            ((_, turn),) = study.sensors.entries(drawn["imu_rotation"], seed)
            self.assertTrue(0.01 <= abs(gyro["error"]) <= 0.05 and gyro["axis"] in range(4), gyro)
            self.assertTrue(1.0 <= math.degrees(math.hypot(*turn.values())) <= 5.0, turn)
            acting = [acts for _, acts in study.sensors.flights(drawn["one_flight_antenna"], seed, ["a", "b", "c"])]
            self.assertEqual((len(acting), sum(acting)), (5, 1))
        self.assertEqual(study.sensors.flights(drawn["product"], 801, ["a", "b", "c"]), [(n, True) for n in "abcab"])

    def test_logs_are_flown_again_when_what_is_drawn_or_done_to_them_changes(self):
        drawn = {c.name: c for c in study.cases(self.study, self.catalogue, study.toml(study.SENSORS))}
        flown = []

        def fly(case, seed, folder, _, of):
            flown.append(case.name)
            study.write_scenario(folder, "", study.entries_of(case, seed), of)
            log = folder / "flight.csv"
            log.write_text("# head\n" + ",".join(["t[s]", *study.sensors.GYRO]) + "\n0,9,0,0\n")
            return [log], {"vertical": "completed"}

        case = drawn["gyro_clips"]
        other = dataclasses.replace(case, drawn={**case.drawn, "gyro_range_rad_s": 2.0})
        antenna = drawn["one_flight_antenna"]
        places = [dataclasses.replace(antenna, drawn={**antenna.drawn, "flight": [i, i]}) for i in range(2)]
        with tempfile.TemporaryDirectory() as name, unittest.mock.patch.object(study, "fly", fly):
            folder = pathlib.Path(name) / "trial"
            for c, times in ((case, 1), (case, 1), (other, 2), (other, 2), (places[0], 3), (places[0], 3), (places[1], 4)):
                (log,), ends = study.logs_of(c, 801, folder, None, self.study)
                self.assertEqual((len(flown), ends), (times, {"vertical": "completed"}), c.name)
                if c is other:
                    self.assertEqual(log.read_text().splitlines()[-1], "0,2,0,0")

    def test_clipped_and_disturbed_logs_change_what_they_should_and_nothing_else(self):
        drawn = {c.name: c for c in study.cases(self.study, self.catalogue, study.toml(study.SENSORS))}
        columns = ["t[s]", "pose_t[s]", *study.sensors.POSITION, *study.sensors.QUATERNION, *study.sensors.GYRO]
        rows = [[f"{0.01 * i:.2f}", f"{0.01 * i:.2f}", "0", "0", "1", "1", "0", "0", "0", f"{6 * math.sin(0.05 * i):.6f}", "0", "0"] for i in range(1500)]
        with tempfile.TemporaryDirectory() as name:
            for case, changed in (("gyro_clips", study.sensors.GYRO[:1]), ("pose_bursts", study.sensors.POSITION + study.sensors.QUATERNION)):
                log = pathlib.Path(name) / "1.csv"
                log.write_text("# head\n" + ",".join(columns) + "\n" + "".join(",".join(r) + "\n" for r in rows))
                study.sensors.spoil(log, drawn[case], 801)
                after = [line.split(",") for line in log.read_text().splitlines()[2:]]
                for c, column in enumerate(columns):
                    share = sum(float(a[c]) != float(b[c]) for a, b in zip(rows, after)) / len(rows)
                    self.assertTrue(0.01 < share < 0.6 if column in changed else share == 0, (case, column, share))
                if case == "gyro_clips":
                    self.assertEqual(max(float(r[columns.index("gyro_x[rad/s]")]) for r in after), 4.363)

    def test_seeds_are_counted_as_runs(self):
        self.assertEqual(score.spans({508, 506, 507, 565, 510, 511}), "506 to 508, 510 to 511, 565")
        self.assertEqual(score.spans({7}), "7")
        self.assertEqual(score.spans(set()), "")


if __name__ == "__main__":
    unittest.main()
