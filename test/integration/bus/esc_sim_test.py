"""`rotorloop esc-sim` as a device that is configured, killed, restarted, given an id and new firmware: its processes and those of the tools.

Every wait is for an event, with a deadline that only a hanging program reaches.
usage: esc_sim_test.py PATH_TO_ROTORLOOP
"""
import json
import signal
import subprocess
import sys

import bus_namespace
from bus_test import DEADLINE_s, PLANT, SOURCE, BusCommand
from rotorloop_cli import main

BUS = ("--bus", "mcast:3")


class EscDevice(BusCommand):
    def esc_command(self, *words):
        return self.run_command("esc", *words, *BUS)

    def good(self, *words):
        done = self.esc_command(*words)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done

    def stored(self, node=21, index=0):
        return self.esc("mcast:3", node, index, "--store", self.path / "esc.flash")

    def stored_in_bootloader(self):
        esc = self.start("esc-sim", *BUS, "--node-id", "21", "--esc-index", "0", "--plant", PLANT, "--store", self.path / "esc.flash")
        self.line_with(esc.stdout, "update: the node reads its image")
        return esc

    def parameters(self, node=21):
        return {p["name"]: p for p in json.loads(self.good("get", "--node", node, "--json").stdout)[0]["parameters"]}

    def image(self, *options):
        path = self.path / "esc.bin"
        subprocess.run([sys.executable, SOURCE / "scripts/make_test_image", path, *options], check=True, timeout=120)
        return path

    def test_parameters_have_defaults_and_limits(self):
        self.esc()
        read = self.parameters()
        self.assertGreaterEqual(len(read), 40)
        self.assertEqual((read["pole_pairs"]["value"], read["pole_pairs"]["min"], read["pole_pairs"]["max"]), (7, "1", "32"))
        self.assertRegex(self.esc_command("get", "--node", "21").stdout, r"  status_Hz +50 +50 +2 +200")

    def test_what_is_set_and_saved_survives_a_kill_and_goes_before_the_command_line(self):
        esc = self.stored()
        self.assertIn("status_Hz = 77 (was 50)", self.good("set", "--node", "21", "status_Hz=77", "node_id=31", "--save").stdout)
        esc.kill()
        esc.communicate()
        esc = self.stored()
        self.assertEqual(self.parameters(31)["status_Hz"]["value"], 77)
        esc.send_signal(signal.SIGINT)
        self.assertIn("holds saved parameters", esc.communicate(timeout=DEADLINE_s)[1])

    def test_two_processes_never_share_a_flash(self):
        self.stored()
        done = self.run_command("esc-sim", *BUS, "--node-id", "22", "--esc-index", "1", "--store", "esc.flash", "--plant", PLANT)
        self.assertEqual(done.returncode, 3, done.stderr)
        self.assertIn("is the flash of an ESC that runs", done.stderr)

    def test_a_restarted_esc_is_operational_again_and_turns(self):
        esc = self.esc()
        self.assertEqual(json.loads(self.good("restart", "--node", "21", "--json").stdout), {"node": 21, "ok": True, "what": "restarts"})
        self.line_with(esc.stdout, "operational: node 21")
        self.settles_at(4000)

    def test_set_says_what_waits_for_a_restart(self):
        self.esc()
        self.assertNotIn("restart:", self.good("set", "--node", "21", "status_Hz=60").stderr)
        done = self.good("set", "--node", "21", "pole_pairs=6", "--save")
        self.assertIn("node 21: in force only after a restart: pole_pairs; rotorloop esc restart --node 21", done.stderr)
        self.good("restart", "--node", "21")
        self.assertEqual(self.parameters()["stat_restart"]["value"], "none")

    def test_a_value_out_of_range_or_a_misspelt_name_changes_nothing(self):
        self.esc()
        for words, text in ((("status_Hz=60", "phase_limit=999"), "phase_limit = 999 is out of range"), (("status_Hz=60", "pole_pears=7"), 'did you mean "pole_pairs"')):
            done = self.esc_command("set", "--node", "21", *words)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(text, done.stderr)
        self.assertEqual(self.parameters()["status_Hz"]["value"], 50)

    def test_a_motor_file_sets_the_constants_of_the_motor(self):
        self.esc()
        self.good("set", "--node", "21", "--from", PLANT.parent / "motors/2306_2300kv.toml")
        self.assertAlmostEqual(self.parameters()["inductance"]["value"], 16.5e-6, delta=1e-9)

    def test_parameters_go_to_a_file_and_to_another_esc_without_its_identity(self):
        self.esc()
        self.esc("mcast:3", 22, 1)
        self.good("set", "--node", "21", "status_Hz=80")
        self.good("dump", "--node", "21", "-o", "a.toml")
        done = self.esc_command("diff", "a.toml", "--node", "22", "--json")
        self.assertEqual(done.returncode, 8, done.stderr)
        self.assertEqual({d["name"] for d in json.loads(done.stdout)}, {"node_id", "esc_index", "status_Hz"})
        self.assertIn("status_Hz = 80 (was 50)", self.good("restore", "a.toml", "--node", "22").stdout)
        self.good("set", "--node", "21", "status_Hz=90")
        told = [json.loads(line) for line in self.good("clone", "--from", "21", "--to", "22", "--save", "--json").stdout.splitlines()]
        self.assertEqual([(t.get("name"), t.get("value"), t.get("saved")) for t in told], [("status_Hz", 90, None), (None, None, True)])
        read = self.parameters(22)
        self.assertEqual((read["status_Hz"]["value"], read["esc_index"]["value"], read["node_id"]["value"]), (90, 1, 22))

    def test_an_id_is_given_and_the_same_one_again_by_the_table_on_disk(self):
        for word in ("new", "known"):
            serve = self.start("esc", "serve", *BUS, "--table", "ids.txt")
            self.line_with(serve.stderr, "serving:")
            esc = self.start("esc-sim", *BUS, "--node-id", "auto", "--esc-index", "3", "--plant", PLANT)
            self.assertIn("node 125", self.line_with(serve.stdout, word + " "))
            self.line_with(esc.stdout, "operational: node 125, esc_index 3")
            for process in (esc, serve):
                process.kill()
                process.communicate()
        self.assertRegex((self.path / "ids.txt").read_text(encoding="utf-8"), r"\n[0-9a-f]{32} = 125\n")

    def test_commands_work_beside_an_allocator_and_a_monitor(self):
        self.esc()
        self.line_with(self.start("esc", "serve", *BUS).stderr, "serving:")
        self.line_with(self.start("esc", "monitor", *BUS, "--json").stdout, '"esc_index":0')
        self.assertEqual(self.parameters()["status_Hz"]["value"], 50)

    def test_its_button_or_a_hand_enumerates_it(self):
        escs = {node: self.esc("mcast:3", node, 9 + node - 21, "--store", self.path / f"{node}.flash") for node in (21, 22)}
        enumerate_ = self.start("esc", "enumerate", *BUS, "--json")
        for index, node in enumerate((22, 21)):
            self.line_with(enumerate_.stdout, f'{{"motor":{index},"what":"waiting","left":{2 - index}}}')
            escs[node].send_signal(signal.SIGUSR1 if node == 22 else signal.SIGUSR2)  # its button; a hand at its rotor
            self.line_with(enumerate_.stdout, f'{{"motor":{index},"what":"saved","node":{node}}}')
        self.assertEqual(enumerate_.wait(timeout=DEADLINE_s), 0)
        self.assertEqual([self.parameters(node)["esc_index"]["value"] for node in (22, 21)], [0, 1])

    def test_new_firmware_is_verified_reported_and_there_after_a_kill(self):
        esc = self.stored()
        image = self.image("--version", "3.4", "--commit", "c0ffee")
        self.esc("mcast:3", 22, 1)
        done = self.good("flash", image, "--node", "21,22")  # both at once
        for node in (21, 22):
            self.assertRegex(done.stdout, rf"node {node}: done, runs 3\.4, image CRC [0-9a-f]{{16}} as in the file")
        self.line_with(esc.stdout, "firmware 3.4")
        esc.kill()
        esc.communicate()
        self.stored()
        info = json.loads(self.good("info", "--node", "21", "--json").stdout)[0]
        self.assertEqual((info["software"], info["vcs_commit"]), ("3.4", "00c0ffee"))
        self.settles_at(4000)

    def test_the_plan_is_shown_before_and_every_node_of_a_board_is_updated(self):
        self.esc()
        self.esc("mcast:3", 22, 1)
        done = self.good("flash", self.image("--version", "3.4", "--security", "2"), "--all", "--board", "esc")
        plan = done.stderr[:done.stderr.index("node 21: ")]
        self.assertRegex(plan, r"plan: 65536 bytes for b_g431b_esc1, version 3\.4, security version 2, CRC [0-9a-f]{16}; 2 nodes, about \d+ s")
        for node in (21, 22):
            self.assertRegex(plan, rf"node +{node}  org\.rotorloop\.esc: 0\.1, CRC [0-9a-f]{{16}} -> 3\.4")
            self.assertRegex(done.stderr, rf"node {node}: reading \d+ of 65536 bytes, \d+ s left")
        self.assertEqual(self.esc_command("flash", self.image(), "--all", "--board", "other").returncode, 3)
        self.assertEqual(self.esc_command("flash", self.image(), "--all").returncode, 2)
        self.assertEqual(self.esc_command("flash", self.image()).returncode, 2)

    def test_verify_only_tells_what_runs_and_changes_nothing(self):
        self.esc()
        image = self.image("--version", "3.4")
        done = self.esc_command("flash", image, "--node", "21", "--verify-only")
        self.assertEqual(done.returncode, 8, done.stdout + done.stderr)
        self.assertIn("node 21: differs: 0.1", done.stdout)
        self.good("flash", image, "--node", "21")
        self.assertIn("node 21: same: 3.4", self.good("flash", image, "--node", "21", "--verify-only").stdout)

    def test_nothing_is_updated_that_turns_or_while_somebody_commands(self):
        self.esc()
        self.esc("mcast:3", 22, 1)
        spin = self.start("esc", "spin", *BUS, "--index", "0", "--rpm", "3000", "--for", "600", "--yes", "--json")
        self.line_with(spin.stdout, '"rpm":')
        for node, says in (("21", "node 21 turns with "), ("22", "node 22 is armed")):
            done = self.esc_command("flash", self.image(), "--node", node, "--while-others-fly")
            self.assertEqual(done.returncode, 4, done.stdout + done.stderr)
            self.assertIn(says, done.stderr)
        spin.send_signal(signal.SIGINT)
        spin.communicate(timeout=DEADLINE_s)
        self.good("flash", self.image("--version", "3.4"), "--node", "22")

    def test_a_node_that_waits_in_its_bootloader_is_found_and_recovered(self):
        esc = self.stored()
        image = self.image("--version", "5.0")
        done = self.esc_command("flash", image, "--recover")
        self.assertEqual(done.returncode, 3, done.stdout + done.stderr)
        self.assertIn("no node waits in its bootloader", done.stderr)
        flash = self.start("esc", "flash", *BUS, image, "--node", "21")
        self.line_with(flash.stderr, "reading 3")
        for process in (flash, esc):
            process.kill()
            process.communicate()
        esc = self.stored_in_bootloader()
        done = self.good("flash", image, "--recover")
        self.assertIn("waits in its bootloader -> 5.0", done.stderr)
        self.assertRegex(done.stdout, r"node 21: done, runs 5\.0")
        self.line_with(esc.stdout, "firmware 5.0")

    def test_firmware_for_another_board_or_damaged_is_refused_and_the_old_one_runs(self):
        self.esc()
        done = self.esc_command("flash", self.image("--board", "other"), "--node", "21")
        self.assertEqual(done.returncode, 3, done.stdout + done.stderr)
        self.assertIn("image is for another board", done.stdout)
        self.assertIn("do:     look at board, signature and security version", done.stdout)
        image = self.image()
        image.write_bytes(image.read_bytes()[:-1] + b"\x00")
        done = self.esc_command("flash", image, "--node", "21")
        self.assertEqual(done.returncode, 2, done.stdout + done.stderr)
        self.assertIn("its CRC does not fit", done.stderr)
        self.assertEqual(json.loads(self.good("info", "--node", "21", "--json").stdout)[0]["software"], "0.1")

    def test_an_update_cut_by_a_kill_goes_on_after_it(self):
        esc = self.stored()
        flash = self.start("esc", "flash", *BUS, self.image("--version", "5.0"), "--node", "21")
        self.line_with(flash.stderr, "reading 3")  # some ten thousand bytes of 65536
        esc.kill()
        esc.communicate()
        esc = self.stored_in_bootloader()
        self.line_with(esc.stdout, "firmware 5.0")
        out, err = flash.communicate(timeout=DEADLINE_s)
        self.assertEqual(flash.returncode, 0, out + err)


# Of the tests of bus_test.py only its helpers are wanted here.
for name in [n for n in dir(BusCommand) if n.startswith("test_")]:
    if name not in EscDevice.__dict__:
        setattr(EscDevice, name, None)
del BusCommand

if __name__ == "__main__":
    bus_namespace.enter()
    main(sys.argv)
