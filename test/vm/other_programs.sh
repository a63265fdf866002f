#!/bin/bash
# In the guest: a script by the Python of build/venv, which has the packages of scripts/requirements-test.txt, vcan0 and
# vcan1. What is run is read before: while the guest waits for the host's disk its clock runs on.
# usage: other_programs.sh SCRIPT ROTORLOOP WORDS…
set -e
venv=$(realpath "$(dirname "$0")/../../build/venv")
if [ ! -x "$venv/bin/python3" ]; then echo "skipped: 1 program; no build/venv (scripts/lib.sh: test_venv)"; exit 77; fi
# Without its symbols for a debugger, nine tenths of a program that lie behind what is loaded.
for program in $(type -P "${@:2}" ip candump cansend cangen); do
  end=$(readelf -lW "$program" | (while read -r kind offset _ _ size _; do [ "$kind" != LOAD ] || end=$((offset + size)); done; echo "$end"))
  head -c "$end" "$program" > /dev/null
  cat $(ldd "$program" | grep -o '/[^ ]*') > /dev/null
done
for bus in vcan0 vcan1; do ip link add $bus type vcan; ip link set $bus mtu 72 up; done
ROTORLOOP_PYDRONECAN=$(echo "$venv"/lib/python3*/site-packages) exec "$venv/bin/python3" "$@"
