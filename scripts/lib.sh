# Shared by the scripts: where we are, installing packages, building a preset. Source it, do not run it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

say() { printf '%s\n' "$*" >&2; }

# install_packages FILE…: apt is called only when something is missing, as root or through sudo.
install_packages() {
  local missing=() p
  while read -r p; do
    case "$p" in ''|'#'*) continue ;; esac
    dpkg-query -W -f='${Status}' "$p" 2>/dev/null | grep -q 'install ok installed' || missing+=("$p")
  done < <(cat "$@")
  [ ${#missing[@]} -gt 0 ] || return 0
  local sudo=()
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || { say "error: missing packages: ${missing[*]}"; say "  do: install them as root: apt-get install ${missing[*]}"; exit 3; }
    sudo=(sudo)
  fi
  say "installing: ${missing[*]}"
  "${sudo[@]}" apt-get update -qq
  DEBIAN_FRONTEND=noninteractive "${sudo[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}" >&2
}

# test_venv: independent implementations from PyPI that tests talk to, in build/venv; made anew when their list changes. Where PyPI cannot
# be reached it says so, and the tests that need a package skip. The product never needs them.
test_venv() {
  local list=scripts/requirements-test.txt venv=build/venv
  if ! cmp -s "$list" "$venv/requirements"; then
    rm -rf "$venv"
    if ! { python3 -m venv "$venv" && "$venv/bin/pip" install -q --disable-pip-version-check -r "$list"; } >&2; then
      say "PyPI cannot be reached: tests against its packages are skipped"
      rm -rf "$venv"
      return 0
    fi
    cp "$list" "$venv/requirements"
  fi
  [ -n "${ROTORLOOP_PYDRONECAN:-}" ] || ROTORLOOP_PYDRONECAN=$(echo "$PWD/$venv"/lib/python3*/site-packages)
  export ROTORLOOP_PYDRONECAN
}

# guest_kernel: Debian's kernel for tests in a guest (test/vm), unpacked in build/guest and fetched once: 70 MB, 460 MB unpacked. Where it
# cannot be had, those tests skip.
guest_kernel() {
  local folder=build/guest name
  [ ! -d "$folder/lib/modules" ] || return 0
  name=$(apt-cache depends linux-image-amd64 2>/dev/null | awk '/Depends: linux-image-[0-9]/ { print $2; exit }')
  mkdir -p "$folder"
  if ! { [ -n "$name" ] && (cd "$folder" && apt-get -qq -o APT::Sandbox::User=root download "$name" && dpkg-deb -x linux-image-*.deb . && rm linux-image-*.deb); } >&2; then
    say "the guest's kernel cannot be fetched: tests in a guest are skipped"
    rm -rf "$folder"
  fi
}

# build PRESET [TARGET…]
build() {
  local preset=$1; shift
  [ -f "build/$preset/build.ninja" ] || cmake --preset "$preset" >&2
  if [ $# -gt 0 ]; then cmake --build "build/$preset" --target "$@" >&2; else cmake --build "build/$preset" >&2; fi
}
