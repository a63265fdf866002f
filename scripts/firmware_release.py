"""Puts what belongs to one release of a board's firmware into one folder.

usage: firmware_release.py ELF BOOT_ELF SELFTEST_ELF OUT [--public PEM] [--commit HEX] [--modified]
ELF: the application after firmware_image.py, with its .bin and .rlf beside it; SELFTEST_ELF: likewise, the image for the
first power-up of a board. OUT, which must not be there yet or be empty, receives both
programs as ELF, the image for an update over CAN (.rlf), both programs in one file for a debugger (_all.elf, _all.hex), the linker's maps,
manifest.json (versions, compiler, commit, bytes and SHA-256 of each file) and SHA256SUMS. The same sources give the same bytes.
--public: the public half of the key that the bootloader has; without it that is the test key. An image that is signed with another key is
refused. One that is not signed is in no file with both: that bootloader would not start it.
"""
import argparse
import hashlib
import json
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile

import firmware_image

BOOT_AT, HEX_RECORD_BYTES = 0x08000000, 16
SOURCE = pathlib.Path(__file__).resolve().parent.parent
# Whoever talks to the program, or keeps its files, has to agree on these: where the sources say them.
VERSIONS = {"image header": ("firmware/update/image.hpp", r"kImageHeaderVersion = (\d+)"),
            "fast channel": ("protocols/fast_channel.hpp", r"std::uint8_t kVersion = (\d+)"),
            "state channel": ("protocols/state_channel.hpp", r"std::uint8_t kVersion = (\d+)")}


def versions():
    found = {}
    for name, (file, pattern) in VERSIONS.items():
        match = re.search(pattern, (SOURCE / file).read_text(encoding="utf-8"))
        if not match:
            sys.exit(f"{file}: error: the version of the {name} is not there\n  do: mend VERSIONS in scripts/firmware_release.py")
        found[name] = int(match.group(1))
    return found


def flash_bytes(elf, folder):
    out = folder / "program.bin"
    firmware_image.tool("objcopy", "-O", "binary", "--gap-fill", "0xff", elf, out)  # between sections: as erased flash
    return out.read_bytes()


def intel_hex(parts):
    """Records of both programs, for a tool that takes no ELF. parts: (address, bytes)."""
    def record(kind, address, data):
        body = struct.pack(">BHB", len(data), address, kind) + data
        return f":{(body + bytes([-sum(body) & 0xFF])).hex().upper()}\n"
    lines = []
    for start, data in parts:
        upper = None
        for at in range(start, start + len(data), HEX_RECORD_BYTES):
            if at >> 16 != upper:
                upper = at >> 16
                lines.append(record(4, 0, struct.pack(">H", upper)))
            lines.append(record(0, at & 0xFFFF, data[at - start:at - start + HEX_RECORD_BYTES]))
    return "".join([*lines, record(1, 0, b"")])


def joined_elf(parts, out, folder):
    """One ELF with a segment a program, without symbols: its entry is the reset handler that the first vector table names."""
    names = [f"part{i}.bin" for i in range(len(parts))]
    for name, (_, data) in zip(names, parts):
        (folder / name).write_bytes(data)
    places = "".join(f"  .part{i} {at:#x} : {{ {name}(.data) }}\n" for i, (name, (at, _)) in enumerate(zip(names, parts)))
    entry, = struct.unpack_from("<I", parts[0][1], 4)
    (folder / "joined.ld").write_text(f"TARGET(binary)\nINPUT({' '.join(names)})\nOUTPUT_FORMAT(elf32-littlearm)\nSECTIONS {{\n{places}}}\n")
    subprocess.run(["arm-none-eabi-ld", "-T", "joined.ld", "--strip-all", "-e", f"{entry:#x}", "-o", out.resolve()], cwd=folder, check=True)


def signed_with(image):
    """An Ed25519 signature is the same each time, so the test key's is known by making it again."""
    if image[56:120] == b"\xFF" * 64:
        return "nothing"
    return "the test key, which protects nothing" if firmware_image.signed(image, None) == image else "a key of the maker"


def key_of(boot_bytes, public):
    """Which key the bootloader has; ends when it has another one."""
    key = firmware_image.public_half(public, "DER")[-32:]
    if key not in boot_bytes:
        sys.exit(f"{public or 'test key'}: error: the bootloader does not have this key\n  do: build it with this key: scripts/firmware --release --key")
    return f"{'release' if public else 'test'} key {key.hex()}"


def check_signatures(elf, selftest, public, takes):
    """Application and self-test are signed with the key that the bootloader has, or are both still to be signed; ends otherwise."""
    whose = {program: signed_with(program.with_suffix(".rlf").read_bytes()) for program in (elf, selftest)}
    for program, key in whose.items():
        if key == "nothing" == whose[elf] or key != "nothing" and firmware_image.verified(program.with_suffix(".rlf").read_bytes(), public):
            continue
        sys.exit(f"{program.with_suffix('.rlf')}: error: it is signed with {key}, and the bootloader, which takes the {takes}, would not start it\n"
                 "  do: sign application and self-test with the bootloader's key: scripts/firmware --release --key KEY.pem")


def release(elf, boot, selftest, out, commit, modified, public=None):
    if out.exists() and any(out.iterdir()):
        sys.exit(f"{out}: error: the folder of the release is not empty\n  do: give a new folder, or remove this one")
    image = elf.with_suffix(".rlf").read_bytes()
    with tempfile.TemporaryDirectory() as scratch:
        parts = [(BOOT_AT, flash_bytes(boot, pathlib.Path(scratch))), (firmware_image.HEADER_AT, image)]
    takes = key_of(parts[0][1], public)
    check_signatures(elf, selftest, public, takes)
    out.mkdir(parents=True, exist_ok=True)
    for file in (*(program.with_suffix(suffix) for program in (elf, selftest) for suffix in (".elf", ".rlf", ".map")), boot, boot.with_suffix(".map")):
        shutil.copy(file, out / file.name)
    if signed_with(image) != "nothing":
        with tempfile.TemporaryDirectory() as scratch:
            joined_elf(parts, out / f"{elf.stem}_all.elf", pathlib.Path(scratch))
        (out / f"{elf.stem}_all.hex").write_text(intel_hex(parts), encoding="ascii")
    board, size, security, major, minor = struct.unpack_from("<16sIIBB", image, 8)
    files = {file.name: file.read_bytes() for file in sorted(out.iterdir())}
    sums = {name: hashlib.sha256(data).hexdigest() for name, data in files.items()}
    manifest = {"board": board.rstrip(b"\0").decode(), "version": f"{major}.{minor}", "security_version": security, "commit": f"{commit:08x}",
                "modified": modified, "signed_with": signed_with(image), "bootloader_takes": takes,
                "compiler": firmware_image.tool("g++", "--version").splitlines()[0],
                "payload_bytes": size, "versions": versions(), "files": {name: {"bytes": len(files[name]), "sha256": sums[name]} for name in files}}
    (out / "manifest.json").write_text(json.dumps(manifest, indent=2) + "\n", encoding="utf-8")
    sums["manifest.json"] = hashlib.sha256((out / "manifest.json").read_bytes()).hexdigest()
    (out / "SHA256SUMS").write_text("".join(f"{digest}  {name}\n" for name, digest in sorted(sums.items())), encoding="ascii")
    return manifest


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("elf", type=pathlib.Path)
    parser.add_argument("boot", type=pathlib.Path)
    parser.add_argument("selftest", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--commit", type=lambda text: int(text, 16), default=firmware_image.commit_of(SOURCE))
    parser.add_argument("--modified", action="store_true", help="the tree has changes that the commit does not have")
    parser.add_argument("--public", type=pathlib.Path)
    o = parser.parse_args()
    manifest = release(o.elf, o.boot, o.selftest, o.out, o.commit, o.modified, o.public)
    print(f"{o.out}: {manifest['board']} {manifest['version']}, commit {manifest['commit']}{' with changes' if o.modified else ''}, "
          f"signed with {manifest['signed_with']}, {len(manifest['files']) + 2} files")


if __name__ == "__main__":
    main()
