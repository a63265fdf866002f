#!/bin/bash
# In the guest: a script by the Python of build/venv, which has the packages of scripts/requirements-test.txt, and vcan0. What is run is read
# before: while the guest waits for the host's disk its clock runs on.
# usage: other_programs.sh SCRIPT ROTORLOOP WORDS…
set -e
venv=$(realpath "$(dirname "$0")/../../build/venv")
if [ ! -x "$venv/bin/python3" ]; then echo "skipped: 1 program; no build/venv (scripts/lib.sh: test_venv)"; exit 77; fi
for program in $(type -P "${@:2}" ip candump cansend cangen); do cat "$program" $(ldd "$program" | grep -o '/[^ ]*') > /dev/null; done
ip link add vcan0 type vcan
ip link set vcan0 mtu 72 up
ROTORLOOP_PYDRONECAN=$(echo "$venv"/lib/python3*/site-packages) exec "$venv/bin/python3" "$@"
