"""Writes the manual page of rotorloop from the help that the command prints, so that the two cannot differ.

usage: man_page.py PATH_TO_ROTORLOOP OUTPUT
"""
import re
import subprocess
import sys

FILES = """.SH FILES
.TP
.I share/rotorloop
below the prefix of the installation: vehicles, scenarios, the catalogue of effects, and docs (start with docs/manual.md). A path on
the command line that does not exist in the working folder is looked for there.
.SH "SEE ALSO"
.I share/rotorloop/docs/manual.md
"""


def help_of(program, *words):
    return subprocess.run([program, *words, "--help"], check=True, capture_output=True, text=True, encoding="utf-8").stdout


def subcommands(text):
    part = re.search(r"^Subcommands:\n((?:  .*\n)+)", text, re.MULTILINE)
    return re.findall(r"^  (\S+)", part.group(1), re.MULTILINE) if part else []


def roff(text):
    text = text.replace("\\", "\\e").replace("-", "\\-")
    return "\n".join("\\&" + line if line[:1] in (".", "'") else line for line in text.splitlines())


def section(program, words):
    text = help_of(program, *words)
    out = f'.SH "rotorloop {" ".join(words)}"\n.nf\n{roff(text.strip())}\n.fi\n'
    return out + "".join(section(program, (*words, name)) for name in subcommands(text))


def main():
    program, output = sys.argv[1:]
    version = subprocess.run([program, "--version"], check=True, capture_output=True, text=True).stdout.split()[1]
    text = help_of(program)
    name = roff(text.splitlines()[0]).replace(": ", " \\- ", 1)
    page = (f'.TH ROTORLOOP 1 "" "rotorloop {version}" "User Commands"\n.SH NAME\n'
            f"{name}\n.SH SYNOPSIS\n.B rotorloop\n.I command\n[\\fIoptions\\fR]\n"
            f".SH COMMANDS\n.nf\n{roff(text[text.index('Options:'):].strip())}\n.fi\n")
    page += "".join(section(program, (name,)) for name in subcommands(text))
    with open(output, "w", encoding="utf-8") as file:
        file.write(page + FILES)


if __name__ == "__main__":
    main()
