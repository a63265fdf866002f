"""`rotorloop image`: what it makes is byte for byte what the openssl command and Python make of the same payload and key; keys that others can
read are refused; a verdict needs a key; a damaged image is named.

usage: image_test.py PATH_TO_ROTORLOOP
"""
import json
import random
import runpy
import shutil
import stat
import subprocess
import sys

from rotorloop_cli import SOURCE, CommandTest, main

sys.path.insert(0, str(SOURCE / "scripts"))
import firmware_image  # noqa: E402

made = runpy.run_path(str(SOURCE / "scripts/make_test_image"))["image"]
PAYLOAD = random.Random(5).randbytes(5000)
HEADER_BYTES = 512


class Image(CommandTest):
    def setUp(self):
        super().setUp()
        (self.path / "esc.bin").write_bytes(PAYLOAD)

    def ends(self, code, *words):
        done = self.run_command("image", *words)
        self.assertEqual(done.returncode, code, done.stdout + done.stderr)
        self.assertNotIn("PRIVATE KEY", done.stdout + done.stderr)
        return done

    def openssl(self, *words):
        return subprocess.run(["openssl", *words], cwd=self.path, capture_output=True, text=True, check=True).stdout

    def key_of_openssl(self, name, kind="ed25519"):
        self.openssl("genpkey", "-algorithm", kind, "-out", name)
        (self.path / name).chmod(0o600)
        return name

    def bytes(self, name):
        return (self.path / name).read_bytes()

    def refused(self, text, *words):
        """As a mistake of the user; nothing is written."""
        before = sorted(self.path.iterdir())
        self.assertIn(text, self.ends(2, *words).stderr)
        self.assertEqual(sorted(self.path.iterdir()), before)

    def create(self, out, *words):
        return self.ends(0, "create", "esc.bin", "-o", out, "--version", "1.2", "--security", "3", "--commit", "a1b2c3d4", *words)

    def test_an_image_that_is_not_signed_has_the_bytes_of_the_header_that_Python_packs(self):
        self.create("esc.rlf")
        self.assertEqual(self.bytes("esc.rlf"), made(PAYLOAD, "b_g431b_esc1", 1, 2, 3, 0xA1B2C3D4))

    def test_a_signature_has_the_64_bytes_that_the_openssl_command_makes_with_the_same_key(self):
        key = self.key_of_openssl("release.pem")
        self.create("esc.rlf", "--key", key)
        self.assertEqual(self.bytes("esc.rlf"), firmware_image.signed(made(PAYLOAD, "b_g431b_esc1", 1, 2, 3, 0xA1B2C3D4), self.path / key))
        self.create("test.rlf", "--test-key")
        self.assertEqual(self.bytes("test.rlf"), firmware_image.signed(made(PAYLOAD, "b_g431b_esc1", 1, 2, 3, 0xA1B2C3D4), None))
        self.ends(0, "sign", "test.rlf", "-o", "again.rlf", "--key", key)
        self.assertEqual(self.bytes("again.rlf"), self.bytes("esc.rlf"))

    def test_openssl_reads_a_key_that_keygen_made_and_says_the_same_public_half(self):
        done = self.ends(0, "keygen", "mine.pem", "--public", "public.pem")
        self.assertEqual(stat.S_IMODE((self.path / "mine.pem").stat().st_mode), 0o600)
        self.assertEqual(self.openssl("pkey", "-in", "mine.pem", "-pubout"), self.bytes("public.pem").decode())
        half = subprocess.run(["openssl", "pkey", "-in", "mine.pem", "-pubout", "-outform", "DER"], cwd=self.path, capture_output=True, check=True).stdout[-32:]
        self.assertEqual([int(word.strip(",\n"), 16) for word in done.stdout.split() if word.startswith("0x")], list(half))
        self.create("esc.rlf", "--key", "mine.pem")
        self.ends(0, "verify", "esc.rlf", "--key", "public.pem")

    def test_verify_tells_a_good_image_from_one_of_another_key_and_from_one_that_is_not_signed(self):
        self.key_of_openssl("a.pem")
        self.key_of_openssl("b.pem")
        self.openssl("pkey", "-in", "b.pem", "-pubout", "-out", "b_public.pem")
        self.create("a.rlf", "--key", "a.pem")
        self.create("none.rlf")
        self.assertIn("signed by the key of a.pem, and whole", self.ends(0, "verify", "a.rlf", "--key", "a.pem").stdout)
        self.assertIn("not signed by the key of b_public.pem", self.ends(6, "verify", "a.rlf", "--key", "b_public.pem").stderr)
        self.assertIn("the image is not signed", self.ends(6, "verify", "none.rlf", "--key", "a.pem").stderr)

    def test_a_byte_changed_anywhere_is_never_verified(self):
        self.key_of_openssl("a.pem")
        self.create("a.rlf", "--key", "a.pem")
        good = self.bytes("a.rlf")
        for at in (*range(0, 184, 8), HEADER_BYTES, HEADER_BYTES + 2500, len(good) - 1):
            with self.subTest(at=at):
                (self.path / "bad.rlf").write_bytes(good[:at] + bytes([good[at] ^ 0x10]) + good[at + 1:])
                done = self.run_command("image", "verify", "bad.rlf", "--key", "a.pem")
                self.assertIn(done.returncode, (5, 6), done.stdout + done.stderr)
                self.assertIn("bad.rlf", done.stderr)

    def test_info_says_what_the_image_is_and_whose_signature_it_has(self):
        self.create("none.rlf")
        self.create("test.rlf", "--test-key")
        self.create("own.rlf", "--key", self.key_of_openssl("own.pem"))
        self.assertEqual([json.loads(self.ends(0, "info", name, "--json").stdout)["signature"] for name in ("none.rlf", "test.rlf", "own.rlf")],
                         ["none", "test key", "other key"])
        said = json.loads(self.ends(0, "info", "own.rlf", "--json").stdout)
        self.assertEqual((said["board"], said["software_major"], said["software_minor"], said["security_version"], said["vcs_commit"], said["payload_bytes"]),
                         ("b_g431b_esc1", 1, 2, 3, "a1b2c3d4", 5000))
        self.assertRegex(self.ends(0, "info", "test.rlf").stdout, "version +1.2, commit a1b2c3d4\n(.*\n)+.*by the test key, which everybody has: it protects nothing")

    def test_a_cut_image_and_a_file_that_is_none_are_data_that_cannot_be_used(self):
        self.create("esc.rlf")
        (self.path / "cut.rlf").write_bytes(self.bytes("esc.rlf")[:-1])
        self.assertIn("(4999 of 5000 payload bytes)", self.ends(5, "info", "cut.rlf").stderr)
        (self.path / "head.rlf").write_bytes(self.bytes("esc.rlf")[:100])
        self.assertIn("(0 of 5000 payload bytes)", self.ends(5, "info", "head.rlf").stderr)
        self.assertIn("its header is missing", self.ends(5, "info", "esc.bin").stderr)
        self.assertIn("its header is missing", self.ends(5, "sign", "esc.bin", "-o", "out.rlf", "--test-key").stderr)

    def test_a_private_key_that_others_can_read_of_another_kind_or_with_a_pass_phrase_is_refused(self):
        self.key_of_openssl("a.pem")
        (self.path / "a.pem").chmod(0o640)
        words = ("create", "esc.bin", "-o", "out.rlf", "--version", "1.0", "--key")
        self.refused("has mode 0640: others can read or write this private key, and 0600 is expected", *words, "a.pem")
        self.key_of_openssl("x.pem", "x25519")
        self.refused("is a key for X25519, and images are signed with Ed25519", *words, "x.pem")
        self.openssl("genpkey", "-algorithm", "ed25519", "-aes256", "-pass", "pass:secret", "-out", "locked.pem")
        (self.path / "locked.pem").chmod(0o600)
        self.refused("is no PEM file of a private key, or has a pass phrase", *words, "locked.pem")
        self.refused("cannot read the key: No such file or directory", *words, "nowhere.pem")

    def test_a_key_that_is_there_is_never_replaced(self):
        self.ends(0, "keygen", "mine.pem")
        before = self.bytes("mine.pem")
        self.refused("is there already, and a key is never replaced", "keygen", "mine.pem")
        self.assertEqual(self.bytes("mine.pem"), before)

    def test_what_does_not_fit_the_header_or_is_no_payload_is_refused_by_name(self):
        words = ("create", "esc.bin", "-o", "out.rlf")
        for text, *more in (('"1.256" is not MAJOR.MINOR', "--version", "1.256"), ('"1" is not MAJOR.MINOR', "--version", "1"),
                            ('"xyz" is not a commit', "--version", "1.0", "--commit", "xyz"),
                            ('has 17 characters: 1 to 16 are possible', "--version", "1.0", "--board", "a" * 17)):
            with self.subTest(text=text):
                self.refused(text, *words, *more)
        self.create("esc.rlf")
        self.refused("is an image already", "create", "esc.rlf", "-o", "out.rlf", "--version", "1.0")
        (self.path / "esc.elf").write_bytes(b"\x7fELF" + bytes(60))
        self.refused("is an ELF", "create", "esc.elf", "-o", "out.rlf", "--version", "1.0")
        self.refused("no key is given", "sign", "esc.rlf", "-o", "out.rlf")


if __name__ == "__main__":
    if not shutil.which("openssl"):
        print("skipped: 1 program; openssl is missing")
        sys.exit(77)
    main(sys.argv)
