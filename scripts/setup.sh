#!/usr/bin/env bash
# Installs what Caustica's build and tests need, and nothing that is already there.
#   scripts/setup.sh            check, then install what is missing
#   scripts/setup.sh --check    check only; exit 1 and name what is missing
# Debian 13: everything from its own suite. Debian 12: its own suite ships Embree 3, so the
# Debian 13 suite is added at priority 100 (nothing moves to it by itself) and Embree, and Rust if
# there is none, come from there. See docs/decisions/0001-embree-from-debian-13.md.
set -euo pipefail

EMBREE_MIN=40300   # RTC_VERSION: 4.3.0, the first with today's ray layout
RUST_MIN=85        # 1.85: edition 2024

say() { printf 'setup: %s\n' "$*"; }
have() { command -v "$1" >/dev/null 2>&1; }

embree_ok() {
  local config v
  for config in "${EMBREE_DIR:-/usr}"/include/embree4/rtcore_config.h; do
    [ -r "$config" ] || return 1
    v=$(sed -n 's/^#define RTC_VERSION \([0-9]*\).*/\1/p' "$config")
    [ "${v:-0}" -ge "$EMBREE_MIN" ] && return 0
  done
  return 1
}
oiio_ok()     { have pkg-config && pkg-config --exists OpenImageIO; }
tool_ok()     { have oiiotool; }
libclang_ok() {
  [ -n "${LIBCLANG_PATH:-}" ] && return 0
  compgen -G '/usr/lib/llvm-*/lib/libclang*.so*' >/dev/null || compgen -G '/usr/lib/*/libclang*.so*' >/dev/null
}
cxx_ok()      { have c++ && have cc && have make; }
rust_ok() {
  have cargo && have rustc || return 1
  local minor
  minor=$(rustc --version | sed -n 's/^rustc 1\.\([0-9]*\)\..*/\1/p')
  [ "${minor:-0}" -ge "$RUST_MIN" ]
}

# A Rust that rustup put into the home directory is not always on a script's PATH.
[ -d "$HOME/.cargo/bin" ] && PATH="$HOME/.cargo/bin:$PATH"

packages=()     # from the suite this machine runs
newer=()        # from the Debian 13 suite where the machine runs Debian 12
cxx_ok      || packages+=(build-essential)
have pkg-config || packages+=(pkg-config)
libclang_ok || packages+=(libclang-dev)
oiio_ok     || packages+=(libopenimageio-dev)
tool_ok     || packages+=(openimageio-tools)
embree_ok   || newer+=(libembree-dev)
rust_ok     || newer+=(cargo rustc rustfmt rust-clippy)

if [ ${#packages[@]} -eq 0 ] && [ ${#newer[@]} -eq 0 ]; then
  say "nothing to do"
  exit 0
fi

. /etc/os-release
suite=${VERSION_CODENAME:-unknown}
case "${ID:-}:$suite" in
  debian:bookworm) from=(-t trixie) ;;
  debian:*)        from=() ;;
  *) say "this script knows Debian 12 and 13 only; this is ${PRETTY_NAME:-an unknown system}."
     say "install by hand: Embree >= 4.3 with headers, OpenImageIO with headers and oiiotool, libclang, a C++ compiler, make, pkg-config, Rust >= 1.$RUST_MIN"
     say "missing here: ${packages[*]-} ${newer[*]-}"
     exit 1 ;;
esac

root=()
rights=yes
if [ "$(id -u)" -ne 0 ]; then
  if have sudo && sudo -n true 2>/dev/null; then root=(sudo -n); else rights=no; fi
fi
if [ "${1:-}" = --check ] || [ "$rights" = no ]; then
  say "missing: ${packages[*]-} ${newer[*]-}"
  say "as root, run:"
  [ ${#newer[@]} -gt 0 ] && [ ${#from[@]} -gt 0 ] &&
    say "  (first add the Debian 13 suite 'trixie' to the apt sources, pinned at priority 100)"
  [ ${#packages[@]} -gt 0 ] && say "  apt-get install ${packages[*]}"
  [ ${#newer[@]} -gt 0 ] && say "  apt-get install ${from[*]-} ${newer[*]}"
  exit 1
fi

apt() { "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -y -qq --no-install-recommends "$@" >/dev/null; }
write() { "${root[@]}" tee "$1" >/dev/null; }

if [ ${#newer[@]} -gt 0 ] && [ ${#from[@]} -gt 0 ]; then
  # The mirror is the one this machine already uses.
  mirror=$(apt-get indextargets --format '$(SITE) $(CODENAME)' 'Created-By: Packages' 2>/dev/null | awk '$2=="bookworm"{print $1; exit}')
  mirror=${mirror:-$(grep -hoE '(https?|file)://[^ ]+/debian/?( |$)' /etc/apt/sources.list /etc/apt/sources.list.d/* 2>/dev/null | head -n 1 | tr -d ' ')}
  [ -n "$mirror" ] || { say "no Debian mirror found in the apt sources; run apt-get update first"; exit 1; }
  say "adding the Debian 13 suite of ${mirror} at priority 100: ${newer[*]} (and a newer libc) come from it"
  printf 'Types: deb\nURIs: %s\nSuites: trixie\nComponents: main\nSigned-By: /usr/share/keyrings/debian-archive-keyring.gpg\n' "$mirror" |
    write /etc/apt/sources.list.d/caustica-trixie.sources
  printf 'Package: *\nPin: release n=trixie\nPin-Priority: 100\n' | write /etc/apt/preferences.d/caustica-trixie
fi

say "installing ${packages[*]-} ${newer[*]-}"
apt update
# Debian 13's packages first: an upgraded libc must not split the second installation.
[ ${#newer[@]} -eq 0 ]    || apt install "${from[@]}" "${newer[@]}"
[ ${#packages[@]} -eq 0 ] || apt install "${packages[@]}"
say "done"
