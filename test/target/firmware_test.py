"""The program that is flashed into an ST B-G431B-ESC1: built twice, in two folders, it is the same byte for byte, and within its limits.

usage: firmware_test.py SOURCE_FOLDER WORK_FOLDER
Skipped (77) without the cross compiler; exit code 1: other bytes, or beyond a limit (scripts/firmware_image.py prints which).
"""
import pathlib
import shutil
import subprocess
import sys

TARGET, BOOT = "b_g431b_esc1.elf", "b_g431b_esc1_boot.elf"
NEEDED = ("CMakeLists.txt", "CMakePresets.json", "cmake", "protocols", "firmware", "host", "scripts", "third_party")


def build(source, folder):
    subprocess.run(["cmake", "--preset", "firmware", "-S", str(source), "-B", str(folder)], cwd=source, check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", str(folder), "--target", TARGET, BOOT], check=True, stdout=subprocess.DEVNULL)
    elf = folder / "bin" / TARGET
    image = [sys.executable, "-B", str(source / "scripts/firmware_image.py"), str(elf), "--commit", "0", "--check"]
    boot = [sys.executable, "-B", str(source / "scripts/boot_check.py"), str(folder / "bin" / BOOT), "--check"]
    code = subprocess.run(image).returncode or subprocess.run(boot).returncode
    return code, elf.with_suffix(".bin").read_bytes() + (folder / "bin" / BOOT).read_bytes()


def main(source, work):
    if not shutil.which("arm-none-eabi-g++"):
        print("skipped: 1 program; arm-none-eabi-g++ is missing")
        return 77
    shutil.rmtree(work, ignore_errors=True)
    other = work / "a copy"
    other.mkdir(parents=True)
    for name in NEEDED:
        (shutil.copytree if (source / name).is_dir() else shutil.copy)(source / name, other / name)
    code, first = build(source, work / "build")
    _, second = build(other, other / "build")
    if first != second:
        at = next((i for i, (a, b) in enumerate(zip(first, second)) if a != b), min(len(first), len(second)))
        print(f"{TARGET} and {BOOT}: built in another folder they differ from byte {at:#x} on", file=sys.stderr)
        return 1
    return 1 if code else 0


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    sys.exit(main(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2])))
