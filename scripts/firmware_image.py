"""Finishes the program of an ESC, and judges it.

usage: firmware_image.py ELF [--check] [--commit HEX] [--version MAJOR.MINOR] [--security N] [--key PEM | --unsigned]
       firmware_image.py --public-half PEM    prints the public half of a key, as PEM
Writes the header of firmware/update/image.hpp into the ELF and beside it ELF's name with .bin and .rlf. It is signed with the test key
(firmware/update/update_key.hpp), or with the Ed25519 key of a PEM file that its owner alone can read (docs/security.md). --check: prints sizes, static RAM, the bound of the stack and what must not be in it; exit 6 when one is beyond its
limit. Reads the .su files of the same build.
"""
import argparse
import hashlib
import pathlib
import re
import runpy
import struct
import subprocess
import sys
import tempfile

import firmware_stack

HERE = pathlib.Path(__file__).parent
IMAGE = runpy.run_path(str(HERE / "make_test_image"))
TEST_KEY = bytes.fromhex("302e020100300506032b657004220420") + b"rotorloop test key, not a secret"  # PKCS#8
BOARD, HEADER_AT, HEADER_BYTES = "b_g431b_esc1", 0x08006000, 512
LIMITS = {"payload": 92 * 1024, "static RAM": 12_800, "static RAM and stack": 20 * 1024, "CCM": 10 * 1024}
FOREIGN = re.compile(r"^(?:__aeabi_(?:d\w+|[iluf]+2d|u?ldivmod|f2u?lz|cd\w+)|__\w+df\w*|_*malloc|_*free|_*calloc|_*realloc|_sbrk|_Zn[wa]\w*|_Zd[la]\w*"
                     r"|(?:sin|cos|tan|sqrt|exp|log|pow|atan2?|floor|ceil|round|fmod)f?|__cxa_throw|_Unwind_\w+)$")


def tool(name, *words):
    return subprocess.run(["arm-none-eabi-" + name, *map(str, words)], check=True, capture_output=True, text=True).stdout


def sections(elf):
    """By name: (size, run address, load address)."""
    found = {}
    for line in tool("objdump", "-h", elf).splitlines():
        w = line.split()
        if len(w) > 5 and w[0].isdigit():
            found[w[1]] = (int(w[2], 16), int(w[3], 16), int(w[4], 16))
    return found


def commit_of(folder):
    """Of the tree that is built; 0 where git does not say."""
    done = subprocess.run(["git", "-C", str(folder), "rev-parse", "--short=8", "HEAD"], capture_output=True, text=True)
    return int(done.stdout, 16) if done.returncode == 0 else 0


def signed(image, key_file):
    """By the openssl command, which alone reads the key; none: the test key. Ed25519 over what firmware/update/signature.hpp says."""
    digest = hashlib.sha512(image[HEADER_BYTES:]).digest()
    with tempfile.TemporaryDirectory() as folder:
        key, message = pathlib.Path(folder, "key"), pathlib.Path(folder, "message")
        key.write_bytes(TEST_KEY)
        message.write_bytes(image[:48] + digest)
        form = ("PEM", key_file) if key_file else ("DER", key)
        words = ["openssl", "pkeyutl", "-sign", "-rawin", "-keyform", form[0], "-inkey", str(form[1]), "-in", str(message)]
        signature = subprocess.run(words, capture_output=True).stdout
    if len(signature) != 64:
        sys.exit(f"{key_file}: openssl makes no Ed25519 signature with it: give a key made by `openssl genpkey -algorithm ed25519`")
    return image[:56] + signature + digest + image[184:]


def verified(image, public):
    """Whether a bootloader with this public half would take the image's signature, by the openssl command; none: the test key's."""
    digest = hashlib.sha512(image[HEADER_BYTES:]).digest()
    with tempfile.TemporaryDirectory() as folder:
        key, message, signature = (pathlib.Path(folder, name) for name in ("key", "message", "signature"))
        key.write_bytes(public_half(public))
        message.write_bytes(image[:48] + digest)
        signature.write_bytes(image[56:120])
        words = ["openssl", "pkeyutl", "-verify", "-rawin", "-pubin", "-inkey", str(key), "-in", str(message), "-sigfile", str(signature)]
        return subprocess.run(words, capture_output=True).returncode == 0 and image[120:184] == digest


def public_half(path, form="PEM"):
    """Of a PEM file with a private key that its owner alone can read, or with a public one; of the test key without one."""
    words = ["openssl", "pkey", "-pubout", "-outform", form]
    if path is None:
        return subprocess.run([*words, "-inform", "DER"], input=TEST_KEY, check=True, capture_output=True).stdout
    done = subprocess.run([*words, "-pubin", "-in", str(path)], capture_output=True)
    if done.returncode != 0:
        done = subprocess.run([*words, "-in", str(checked_key(path)), "-passin", "pass:"], capture_output=True)
    if done.returncode != 0:
        sys.exit(f"{path}: openssl reads no key in it: give a key made by `openssl genpkey -algorithm ed25519`, or its public half")
    return done.stdout


def checked_key(path):
    """A file that others can read holds no secret any more."""
    try:
        mode = path.stat().st_mode & 0o777
    except OSError as error:
        sys.exit(f"{path}: {error.strerror}: give the PEM file of the private key")
    if mode & 0o077:
        sys.exit(f"{path}: has mode {mode:04o}, others can read or write it: 0600 is expected; chmod 600, or make a new key if others may have read it")
    return path


def finish(elf, commit, version, security, sign):
    """The image: header and payload."""
    whole = elf.with_suffix(".bin")
    tool("objcopy", "-O", "binary", elf, whole)
    payload = whole.read_bytes()[HEADER_BYTES:]
    image = IMAGE["image"](payload, BOARD, *version, security, commit)
    image = sign(image)
    whole.write_bytes(image)
    elf.with_suffix(".rlf").write_bytes(image)
    header = elf.with_suffix(".header")
    header.write_bytes(image[:HEADER_BYTES])
    tool("objcopy", f"--update-section=.image_header={header}", elf)
    header.unlink()
    return image


def checked(elf, image):
    """Lines of the table, and what is wrong."""
    s = sections(elf)
    stack = firmware_stack.bound(elf)
    ram = sum(s[name][0] for name in (".ram_vectors", ".data", ".bss", ".noinit"))
    values = {"payload": len(image) - HEADER_BYTES, "static RAM": ram, "static RAM and stack": ram + stack.total, "CCM": s[".ccm"][0]}
    rows, wrong = [], []
    for name, value in values.items():
        missed = value > LIMITS[name]
        rows.append(f"| {name} | {value} | {LIMITS[name]}{' **missed**' if missed else ''} |")
        wrong += [f"{name} has {value} bytes, limit {LIMITS[name]}"] if missed else []
    if stack.total > s[".stack"][0]:
        wrong.append(f"the stack may take {stack.total} bytes and has {s['.stack'][0]}")
    wrong += [f"recursion: {' -> '.join(loop)}" for loop in stack.loops]
    wrong += [f"no frame size of {name}" for name in stack.unknown]
    foreign = [line.split()[-1] for line in tool("nm", elf).splitlines() if FOREIGN.match(line.split()[-1])]
    wrong += [f"foreign symbol: {name}" for name in foreign]
    code = tool("objdump", "-d", elf)
    wrong += [f"instruction: {found}" for found in sorted(set(re.findall(r"\tv\w+\.f64|\tvfn?m[as]\.\w+", code)))]
    if s[".image_header"][1] != HEADER_AT or s[".vectors"][1] != HEADER_AT + HEADER_BYTES:
        wrong.append("header or vector table is not where firmware/app/b_g431b_esc1/memory_map.hpp has it")
    rows.append(f"stack: {stack.text()}")
    rows.append(f"double precision, fused multiply-add, heap, mathematics library, 64-bit division, recursion: {'found' if foreign or stack.loops else 'none'}")
    return rows, wrong


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("elf", type=pathlib.Path, nargs="?")
    parser.add_argument("--public-half", type=pathlib.Path)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--commit", type=lambda text: int(text, 16), default=commit_of(HERE))
    parser.add_argument("--version", type=lambda text: tuple(int(part) for part in text.split(".")), default=(0, 1))
    parser.add_argument("--security", type=int, default=0)
    whose = parser.add_mutually_exclusive_group()
    whose.add_argument("--key", type=pathlib.Path)
    whose.add_argument("--unsigned", action="store_true")
    o = parser.parse_args()
    if o.public_half:
        sys.stdout.buffer.write(public_half(o.public_half))
        return 0
    if o.elf is None:
        parser.error("no ELF is given")
    if not 0 <= o.security < 2**32:
        parser.error(f"--security is {o.security}: 0 to {2**32 - 1} is expected")
    key = checked_key(o.key) if o.key else None
    image = finish(o.elf, o.commit, o.version, o.security, (lambda i: i) if o.unsigned else (lambda i: signed(i, key)))
    crc, = struct.unpack_from("<Q", image, 40)
    print(f"{o.elf.name}: version {o.version[0]}.{o.version[1]}, commit {o.commit:08x}, payload {len(image) - HEADER_BYTES} bytes, CRC {crc:016x}, {'not signed' if o.unsigned else f'signed with {key}' if key else 'signed with the test key'}")
    print(f"in {o.elf.parent}: {o.elf.name}, {o.elf.stem}.bin, {o.elf.stem}.rlf")
    if not o.check:
        return 0
    rows, wrong = checked(o.elf, image)
    print("| bytes | value | limit |\n| --- | --- | --- |\n" + "\n".join(rows))
    for line in wrong:
        print(f"{o.elf}: {line}", file=sys.stderr)
    return 6 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
