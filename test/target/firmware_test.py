"""The programs that are flashed into an ST B-G431B-ESC1: built twice, in two folders, every file of a release is the same byte for byte; the
file with both programs, as ELF and as Intel HEX, has the bytes of each at its place; sizes and RAM are within their limits; signed with the
test key, and with a key of one's own that nobody else can read. A bootloader with a key of one's own beside them (release_key/), for boot_run.

usage: firmware_test.py SOURCE_FOLDER WORK_FOLDER
Skipped (77) without the cross compiler; exit code 1: other bytes; 6: beyond a limit (scripts/firmware_image.py prints which).
"""
import hashlib
import pathlib
import shutil
import subprocess
import sys

TARGET, BOOT, SELFTEST = "b_g431b_esc1.elf", "b_g431b_esc1_boot.elf", "b_g431b_esc1_selftest.elf"
APPLICATION_AT = 0x6000  # bytes behind the beginning of the flash
NEEDED = ("CMakeLists.txt", "CMakePresets.json", "cmake", "protocols", "firmware", "host", "scripts", "third_party")


def build(source, folder):
    subprocess.run(["cmake", "--preset", "firmware", "-S", str(source), "-B", str(folder)], cwd=source, check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", str(folder), "--target", TARGET, BOOT, SELFTEST], check=True, stdout=subprocess.DEVNULL)
    elf, boot, selftest = (folder / "bin" / name for name in (TARGET, BOOT, SELFTEST))
    scripts = source / "scripts"
    for words in (("firmware_image.py", elf, "--commit", "0", "--check"), ("boot_check.py", boot, "--check"),
                  ("firmware_image.py", selftest, "--commit", "0")):
        if code := subprocess.run([sys.executable, "-B", scripts / words[0], *words[1:]]).returncode:
            sys.exit(code)
    release = folder / "release"
    shutil.rmtree(release, ignore_errors=True)
    subprocess.run([sys.executable, "-B", scripts / "firmware_release.py", elf, boot, selftest, release, "--commit", "0"], check=True)
    return {file.name: file.read_bytes() for file in sorted(release.iterdir())}


def flash_of(file, kind, scratch):
    subprocess.run(["arm-none-eabi-objcopy", "-I", kind, "-O", "binary", "--gap-fill", "0xff", file, scratch], check=True)
    return scratch.read_bytes()


def check_signature(source, elf, work):
    """What is wrong with the image that a key of openssl's has signed, by openssl's word; restores the image of the test key."""
    secret, public, message, signature = (work / name for name in ("secret.pem", "public.pem", "message", "signature"))
    run = lambda *words: subprocess.run([str(word) for word in words], capture_output=True, text=True)
    run("openssl", "genpkey", "-algorithm", "ed25519", "-out", secret)
    run("openssl", "pkey", "-in", secret, "-pubout", "-out", public)
    sign = (sys.executable, "-B", source / "scripts/firmware_image.py", elf, "--commit", "0")
    good = lambda: run("openssl", "pkeyutl", "-verify", "-rawin", "-pubin", "-inkey", public, "-in", message, "-sigfile", signature).returncode == 0
    wrong = []
    secret.chmod(0o600)
    if run(*sign, "--key", secret).returncode != 0:
        wrong.append("a key of mode 0600 is refused")
    image = elf.with_suffix(".rlf").read_bytes()
    signature.write_bytes(image[56:120])
    message.write_bytes(image[:48] + hashlib.sha512(image[512:]).digest())
    if not good():
        wrong.append("openssl does not verify the signature of the key that it has made")
    message.write_bytes(image[:47] + bytes([image[47] ^ 1]) + hashlib.sha512(image[512:]).digest())
    if good():
        wrong.append("openssl verifies another header")
    secret.chmod(0o640)
    refused = run(*sign, "--key", secret)
    if refused.returncode == 0 or "0640, others can read" not in refused.stderr or elf.with_suffix(".rlf").read_bytes() != image:
        wrong.append(f"a key of mode 0640 is not refused: {refused.stderr}")
    if "PRIVATE KEY" in refused.stdout + refused.stderr or run(*sign).returncode != 0:
        wrong.append("the key is in the output, or the test key does not sign")
    return wrong


def check_release_key(source, elf, work):
    """What is wrong with a bootloader that is built with a release key: 32 bytes 0x17, which boot_run signs with."""
    secret, public, folder, out = work / "release.pem", work / "release_public.pem", work / "release_key", work / "release_of_key"
    run = lambda *words: subprocess.run([str(word) for word in words], capture_output=True, text=True)
    subprocess.run(["openssl", "pkey", "-inform", "DER", "-out", secret], input=bytes.fromhex("302e020100300506032b657004220420") + b"\x17" * 32, check=True)
    secret.chmod(0o600)
    subprocess.run(["openssl", "pkey", "-in", secret, "-pubout", "-out", public], check=True)
    configure = lambda *key: run("cmake", "--preset", "firmware", "-S", source, "-B", folder, "-DROTORLOOP_UPDATE_KEY=release", *key)
    wrong = []
    for bad in ((), (f"-DROTORLOOP_RELEASE_KEY={secret}",)):
        if configure(*bad).returncode == 0:
            wrong.append(f"a release key is asked for and not given as a public one, and the build begins: {bad}")
    subprocess.run(["cmake", "--preset", "firmware", "-S", source, "-B", folder, "-DROTORLOOP_UPDATE_KEY=release", f"-DROTORLOOP_RELEASE_KEY={public}"], cwd=source, check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", folder, "--target", BOOT], check=True, stdout=subprocess.DEVNULL)
    boot = folder / "bin" / BOOT
    selftest = elf.with_name(SELFTEST)
    release = lambda boot, *key: run(sys.executable, "-B", source / "scripts/firmware_release.py", elf, boot, selftest, out, "--commit", "0", *key)
    sign = lambda program, *key: run(sys.executable, "-B", source / "scripts/firmware_image.py", program, "--commit", "0", *key)

    def expect_refused(what, message, boot, *key):
        done = release(boot, *key)
        if done.returncode == 0 or message not in done.stderr or "\n  do: " not in done.stderr or out.exists():
            wrong.append(f"not refused as it should be: {what}: {done.stderr}")
        shutil.rmtree(out, ignore_errors=True)

    expect_refused("a bootloader that has not the test key but another", "does not have this key", boot)
    expect_refused("an application of the test key beside a bootloader of a release key", f"{elf.stem}.rlf: error: it is signed with the test key",
                   boot, "--public", public)
    sign(elf, "--key", secret)
    expect_refused("an application of a release key beside a bootloader of the test key", f"{elf.stem}.rlf: error: it is signed with a key of the maker",
                   elf.with_name(BOOT))
    expect_refused("a self-test of the test key in a release of a key", f"{selftest.stem}.rlf: error: it is signed with the test key",
                   boot, "--public", public)
    sign(elf, "--unsigned")
    expect_refused("a signed self-test beside an application that is not", f"{selftest.stem}.rlf: error: it is signed with the test key",
                   boot, "--public", public)
    for key in (("--key", secret), ("--unsigned",)):
        sign(elf, *key)
        sign(selftest, *key)
        done = release(boot, "--public", public)
        if done.returncode != 0 or '"bootloader_takes": "release key ' not in (out / "manifest.json").read_text():
            wrong.append(f"images with {key[0]} beside a bootloader of this release key: {done.stderr}")
        if (out / f"{elf.stem}_all.hex").exists() != (key[0] == "--key"):
            wrong.append(f"images with {key[0]}: a file with both programs, which is for signed images alone")
        shutil.rmtree(out, ignore_errors=True)
    if sign(elf).returncode != 0 or sign(selftest).returncode != 0:
        wrong.append("the images of the test key are not restored")
    return wrong


def main(source, work):
    if not shutil.which("arm-none-eabi-g++"):
        print("skipped: 1 program; arm-none-eabi-g++ is missing")
        return 77
    shutil.rmtree(work, ignore_errors=True)
    other = work / "a copy"
    other.mkdir(parents=True)
    for name in NEEDED:
        (shutil.copytree if (source / name).is_dir() else shutil.copy)(source / name, other / name)
    first, second = build(source, work / "build"), build(other, other / "build")
    wrong = [f"{name}: built in another folder it differs" for name in first.keys() | second.keys() if first.get(name) != second.get(name)]
    release, scratch = work / "build/release", work / "flash.bin"
    boot = flash_of(release / BOOT, "elf32-littlearm", scratch)
    expected = boot.ljust(APPLICATION_AT, b"\xff") + first[TARGET.replace(".elf", ".rlf")]
    for suffix, kind in (("_all.elf", "elf32-littlearm"), ("_all.hex", "ihex")):
        if flash_of(release / TARGET.replace(".elf", suffix), kind, scratch) != expected:
            wrong.append(f"{suffix}: not the bootloader and the image, each at its place")
    if len(first) != 12:
        wrong.append(f"a release has 12 files: {', '.join(first)}")
    wrong += check_signature(source, work / "build/bin" / TARGET, work)
    wrong += check_release_key(source, work / "build/bin" / TARGET, work)
    for line in wrong:
        print(line, file=sys.stderr)
    return 1 if wrong else 0


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    sys.exit(main(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])))
