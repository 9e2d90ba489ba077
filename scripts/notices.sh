#!/usr/bin/env bash
# Prints the licences and notices of the crates that library and command line are linked from, of this platform and the
# default features: what goes along with the binaries. Called by scripts/install.sh.
set -euo pipefail
cd "$(dirname "$0")/.."

sources=${CARGO_HOME:-$HOME/.cargo}/registry/src
echo "Caustica contains these packages. Embree and OpenImageIO are no part of it; they are loaded from the system."
cargo tree --locked --edges normal,no-proc-macro --prefix none --no-dedupe --format '{p}|{l}|{r}' | sort -u |
  while IFS='|' read -r package licence repository; do
    read -r name version folder <<<"$package"
    [ -z "$folder" ] || continue # caustica itself
    printf '\n==== %s %s, %s\n%s\n' "$name" "${version#v}" "$licence" "$repository"
    # Of several licences another than Apache's, the longest, is chosen.
    files=() others=()
    for file in "$sources"/*/"$name-${version#v}"/{LICEN[CS]E,COPYING,NOTICE,UNLICENSE,COPYRIGHT}*; do
      [ -f "$file" ] || continue
      files+=("$file")
      case ${file##*/} in *APACHE* | *Apache*) ;; *) others+=("$file") ;; esac
    done
    [ ${#others[@]} -eq 0 ] || files=("${others[@]}")
    for file in "${files[@]}"; do
      printf '\n-- %s\n\n' "${file##*/}"
      cat "$file"
    done
    [ ${#files[@]} -gt 0 ] || printf '\nThe package has no text of it.\n'
  done
