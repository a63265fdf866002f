"""Runs a command in a guest on Debian's own kernel, with the host's tree under it: for tests that need what the host's kernel has not (CAN).

QEMU without KVM, network, privileges or a disk; time in the guest is virtual (one instruction, one nanosecond), so that a busy host changes
nothing that is measured there. The guest ends with the command's exit code; 77: QEMU or the kernel is missing here.
usage: guest.py --kernel FOLDER --init PROGRAM [--set NAME=VALUE]… [--module NAME]… -- COMMAND…   FOLDER: an unpacked linux-image package (scripts/lib.sh: guest_kernel)
"""
import argparse
import ctypes
import lzma
import os
import pathlib
import re
import shutil
import signal
import stat
import subprocess
import sys
import tempfile

SKIPPED, NO_VERDICT, TIMEOUT = 77, 98, 124
# What a guest has; others on demand. "vcan echo=1": a frame is confirmed when the driver sent it, as a controller does.
MODULES = ("virtio_pci", "9pnet_virtio", "9p", "can_raw", "vcan echo=1", "vxcan", "sch_tbf")


class Skip(Exception):
    pass


def kernel_image(folder):
    """The kernel without its own unpacker, which costs a guest 3 s: the XZ stream within, kept beside it."""
    image = folder / "vmlinux"
    if not image.exists():
        packed = next(iter(sorted((folder / "boot").glob("vmlinuz-*"))), None)
        if packed is None:
            raise Skip(f"no kernel in {folder}")
        data = packed.read_bytes()
        whole = lzma.LZMADecompressor().decompress(data[data.index(b"\xfd7zXZ\x00"):])
        if whole[:4] != b"\x7fELF":
            raise Skip(f"{packed} holds no kernel that is packed by XZ")
        image.with_suffix(".new").write_bytes(whole)
        image.with_suffix(".new").rename(image)
    return image


def module_files(folder, wanted):
    """[(path, parameters)] in an order in which each comes after those that it needs; what the kernel has built in is left out."""
    versions = sorted((folder / "lib/modules").iterdir()) if (folder / "lib/modules").is_dir() else []
    if not versions:
        raise Skip(f"no kernel modules in {folder}")
    index = {path.stem.replace("-", "_"): path for path in (versions[-1] / "kernel").rglob("*.ko")}
    built_in = {pathlib.Path(line).stem.replace("-", "_") for line in (versions[-1] / "modules.builtin").read_text().split()}
    order = {}

    def add(name, parameters=""):
        name = name.replace("-", "_")
        if name in built_in or name in order:
            return
        if name not in index:
            raise Skip(f"this kernel has no module {name}")
        needs = re.search(rb"\0depends=([^\0]*)\0", index[name].read_bytes())
        for needed in filter(None, needs.group(1).decode().split(",") if needs else []):
            add(needed)
        order[name] = (index[name], parameters)
    for module in wanted:
        add(*module.split(" ", 1))
    return list(order.values())


def archive(files):
    """cpio in the format of the kernel ("newc"): {path: (mode, bytes)}."""
    out = bytearray()

    def record(inode, path, mode, data):
        name = path.encode() + b"\0"
        fields = (inode, mode, 0, 0, 1, 0, len(data), 0, 0, 0, 0, len(name), 0)
        for part in (b"070701" + b"".join(b"%08X" % f for f in fields) + name, data):
            out.extend(part)
            out.extend(b"\0" * (-len(out) % 4))
    for inode, (path, (mode, data)) in enumerate(files.items(), 1):
        record(inode, path, mode, data)
    record(0, "TRAILER!!!", 0, b"")
    return bytes(out)


def initramfs(folder, init, command, environment, modules):
    files = {name: (stat.S_IFDIR | 0o755, b"") for name in ("proc", "sys", "host", "dev", "modules")}
    files["init"] = (stat.S_IFREG | 0o755, init.read_bytes())
    order = ""
    for path, parameters in module_files(folder, MODULES + tuple(modules)):
        files[f"modules/{path.name}"] = (stat.S_IFREG | 0o644, path.read_bytes())
        order += f"{path.name} {parameters}".strip() + "\n"
    files["modules/order"] = (stat.S_IFREG | 0o644, order.encode())
    files["command"] = (stat.S_IFREG | 0o644, b"".join(word.encode() + b"\0" for word in command))
    files["environment"] = (stat.S_IFREG | 0o644, b"".join(f"{k}={v}".encode() + b"\0" for k, v in environment.items()))
    return archive(files)


def end_with_parent():
    """Of QEMU: a test that is killed leaves none behind."""
    PR_SET_PDEATHSIG = 1
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)


def boot(kernel, initrd, limit_s):
    words = ["qemu-system-x86_64", "-accel", "tcg", "-cpu", "qemu64", "-icount", "shift=0,sleep=off", "-rtc", "base=2026-01-01T00:00:00,clock=vm",
             "-M", "pc", "-m", "512", "-smp", "1", "-nodefaults", "-no-user-config", "-display", "none", "-serial", "stdio", "-no-reboot",
             "-device", "isa-debug-exit,iobase=0xf4,iosize=1", "-virtfs", "local,path=/,mount_tag=host,security_model=none,readonly=on,multidevs=remap",
             "-kernel", kernel, "-initrd", initrd, "-append", "console=ttyS0 panic=-1 nokaslr no_timer_check nolapic_timer quiet"]
    try:
        status = subprocess.run([str(w) for w in words], stdin=subprocess.DEVNULL, timeout=limit_s, preexec_fn=end_with_parent).returncode
    except subprocess.TimeoutExpired:
        print(f"guest: no end within {limit_s} s")
        return TIMEOUT
    return status >> 1 if status & 1 and status > 0 else NO_VERDICT


def main():
    words = sys.argv[1:]
    split = words.index("--") if "--" in words else len(words)
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--kernel", required=True, type=pathlib.Path)
    options.add_argument("--init", required=True, type=pathlib.Path)
    options.add_argument("--set", action="append", default=[], help="NAME=VALUE in the command's environment")
    options.add_argument("--module", action="append", default=[], help="one more of the kernel's modules")
    options.add_argument("--limit", type=float, default=550, help="seconds of the host after which the guest is taken for hanging")
    given = options.parse_args(words[:split])
    command = [os.path.abspath(w) if os.path.exists(w) else w for w in words[split + 1:]]
    environment = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "HOME": "/tmp", "LANG": "C.UTF-8", "PYTHONDONTWRITEBYTECODE": "1"}
    environment.update(text.split("=", 1) for text in given.set)
    try:
        if not shutil.which("qemu-system-x86_64"):
            raise Skip("qemu-system-x86_64 is missing (scripts/packages-check.txt)")
        if not given.kernel.is_dir():
            raise Skip(f"no kernel in {given.kernel}; scripts/check fetches it")
        with tempfile.TemporaryDirectory() as folder:
            initrd = pathlib.Path(folder) / "initramfs"
            initrd.write_bytes(initramfs(given.kernel, given.init, command, environment, given.module))
            return boot(kernel_image(given.kernel), initrd, given.limit)
    except Skip as reason:
        print(f"skipped: 1 program; {reason}")
        return SKIPPED


if __name__ == "__main__":
    sys.exit(main())
