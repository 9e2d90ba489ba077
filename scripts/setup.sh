#!/usr/bin/env bash
# Installs what Caustica's build and tests need, and nothing that is already there.
#   scripts/setup.sh            check, then install what is missing
#   scripts/setup.sh --check    check only; exit 1 and name what is missing
# Debian 13: everything from its own suite. Debian 12: its own suite ships Embree 3, so the Debian 13
# suite is added at priority 100 (nothing moves to it by itself), and Embree comes from there. Rust, if
# there is none, is the toolchain that Debian keeps for its browsers (rustc-web).
# See docs/decisions/0001-embree-from-debian-13.md and 0004-rust-from-debian.md.
set -euo pipefail

EMBREE_MIN=40300   # RTC_VERSION: 4.3.0, the first with today's ray layout
RUST_MIN=88        # 1.88: let chains, which obvhs 0.4 uses

say() { printf 'setup: %s\n' "$*"; }
have() { command -v "$1" >/dev/null 2>&1; }

embree_ok() {
  local v
  v=$(sed -n 's/^#define RTC_VERSION \([0-9]*\).*/\1/p' "${EMBREE_DIR:-/usr}/include/embree4/rtcore_config.h" 2>/dev/null) || true
  [ "${v:-0}" -ge "$EMBREE_MIN" ]
}
oiio_ok() { have pkg-config && pkg-config --exists OpenImageIO; }
# Not libclang-cpp, which LLVM's own packages bring: bindgen cannot use it.
libclang_ok() {
  [ -n "${LIBCLANG_PATH:-}" ] && return 0
  local dir
  for dir in '/usr/lib/llvm-*/lib' '/usr/lib/*'; do
    compgen -G "$dir/libclang.so*" >/dev/null || compgen -G "$dir/libclang-[0-9]*.so*" >/dev/null && return 0
  done
  return 1
}
cxx_ok() { have c++ && have cc && have make; }
rust_ok() {
  have cargo && have rustc || return 1
  local minor
  minor=$(rustc --version | sed -n 's/^rustc 1\.\([0-9]*\)\..*/\1/p')
  [ "${minor:-0}" -ge "$RUST_MIN" ]
}

# A Rust that rustup put into the home directory is not always on a script's PATH.
[ -d "${HOME:-/}/.cargo/bin" ] && PATH="$HOME/.cargo/bin:$PATH"

look() {
  packages=()   # from the suite this machine runs
  newer=()      # from the Debian 13 suite where this machine's own is too old
  cxx_ok          || packages+=(build-essential)
  have pkg-config || packages+=(pkg-config)
  libclang_ok     || packages+=(libclang-dev)
  oiio_ok         || packages+=(libopenimageio-dev)
  have oiiotool   || packages+=(openimageio-tools)
  embree_ok       || newer+=(libembree-dev)
  rust_ok         || newer+=(cargo-web rustc-web rustfmt-web rust-web-clippy)
}

look
if [ ${#packages[@]} -eq 0 ] && [ ${#newer[@]} -eq 0 ]; then
  say "nothing to do"
  exit 0
fi

if ! rust_ok && have rustup; then
  say "$(rustc --version 2>/dev/null || echo 'no Rust') is the default of rustup; Rust >= 1.$RUST_MIN is needed. Run:"
  echo 'rustup update stable && rustup default stable'
  exit 1
fi

os=$(. /etc/os-release 2>/dev/null && echo "${ID:-} ${VERSION_ID:-99}") || os=unknown
case $os in
  debian\ 12|debian\ 1[3-9]|debian\ 99) ;;
  *) say "missing: ${packages[*]-} ${newer[*]-}"
     say "this script installs on Debian 12 and 13 only; this is '$os'. Install by hand:"
     say "  Embree >= 4.3 with headers, OpenImageIO with headers and oiiotool, libclang, a C++ compiler, make, pkg-config, Rust >= 1.$RUST_MIN"
     exit 1 ;;
esac

rights=yes
root=()
if [ "$(id -u)" -ne 0 ]; then
  if have sudo && sudo -n true 2>/dev/null; then root=(sudo -n); else rights=no; fi
fi
installing=yes
{ [ "${1:-}" = --check ] || [ "$rights" = no ]; } && installing=no

apt() { "${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -y -qq --no-install-recommends "$@" >/dev/null; }
if [ $installing = yes ]; then
  say "reading the package lists"
  apt update
fi

# Whether apt would by itself install at least this version. The suites that apt knows decide, not
# /etc/os-release: a Debian 12 that once took its libc from Debian 13 calls itself 13.
offers() {
  local candidate
  candidate=$(apt-cache policy "$1" 2>/dev/null | sed -n 's/^ *Candidate: //p')
  case $candidate in
    '' | '(none)') [ "$os" != 'debian 12' ] ;;   # lists never read: go by the release
    *) dpkg --compare-versions "$candidate" ge "$2" ;;
  esac
}
from=()
embree_ok || offers libembree-dev 4.3 || from=(-t trixie)
if ! rust_ok && [ ${#from[@]} -gt 0 ] && offers rustc-web "1.$RUST_MIN"; then
  # Debian 12 with its security updates: only Embree is missing.
  newer=(libembree-dev)
  packages+=(cargo-web rustc-web rustfmt-web rust-web-clippy)
fi
rust_ok || offers rustc-web "1.$RUST_MIN" || from=(-t trixie)

# Debian's own mirror, as this machine already uses it.
mirror() {
  apt-get indextargets --format '$(ORIGIN) $(COMPONENT) $(CODENAME) $(REPO_URI)' 'Created-By: Packages' 2>/dev/null |
    awk '$1 == "Debian" && $2 == "main" && $3 ~ /^(bookworm|trixie)$/ { print $4; exit }'
}
sources=/etc/apt/sources.list.d/caustica-trixie.sources
pin=/etc/apt/preferences.d/caustica-trixie
knows_trixie() {
  apt-get indextargets --format '$(ORIGIN) $(CODENAME)' 'Created-By: Packages' 2>/dev/null | grep -qx 'Debian trixie'
}
suite() {
  printf 'Types: deb\nURIs: %s\nSuites: trixie\nComponents: main\nSigned-By: /usr/share/keyrings/debian-archive-keyring.gpg\n' "$1"
}
pinned() { printf 'Package: *\nPin: release n=trixie\nPin-Priority: 100\n'; }

if [ $installing = no ]; then
  say "missing: ${packages[*]-} ${newer[*]-}"
  say "as root, run:"
  if [ ${#from[@]} -gt 0 ] && ! knows_trixie; then
    at=$(mirror)
    printf "cat > %s <<'END'\n%sEND\n" "$sources" "$(suite "${at:-<your Debian mirror>}")
" "$pin" "$(pinned)
"
  fi
  echo 'apt-get update'
  [ ${#packages[@]} -eq 0 ] || echo "apt-get install --no-install-recommends ${packages[*]}"
  [ ${#newer[@]} -eq 0 ]    || echo "apt-get install --no-install-recommends ${from[*]-}${from:+ }${newer[*]}"
  exit 1
fi

if [ ${#from[@]} -gt 0 ] && ! knows_trixie; then
  at=$(mirror)
  [ -n "$at" ] || { say "no Debian mirror among the apt sources"; exit 1; }
  say "adding the Debian 13 suite at priority 100: ${newer[*]}, and the newer libc they need, come from it"
  suite "$at" | "${root[@]}" tee "$sources" >/dev/null
  pinned | "${root[@]}" tee "$pin" >/dev/null
  apt update
fi

say "installing ${packages[*]-} ${newer[*]-}"
if [ ${#packages[@]} -gt 0 ]; then
  # This suite's packages first: what comes from Debian 13 then replaces the least. On a machine that
  # has Debian 13's libc already its own suite may not fit any more; then all come from there.
  if [ ${#from[@]} -gt 0 ] && ! apt install --simulate "${packages[@]}" 2>/dev/null; then
    newer+=("${packages[@]}")
  else
    apt install "${packages[@]}"
  fi
fi
[ ${#newer[@]} -eq 0 ] || apt install "${from[@]}" "${newer[@]}"

hash -r
look
if [ ${#packages[@]} -gt 0 ] || [ ${#newer[@]} -gt 0 ]; then
  say "still missing after the installation: ${packages[*]-} ${newer[*]-}"
  rust_ok || say "a Rust older than 1.$RUST_MIN comes first on the PATH: $(command -v rustc)"
  exit 1
fi
say "done"
