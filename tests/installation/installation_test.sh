#!/usr/bin/env bash
# installation_test.sh BUILD COMPILER: installs what lies in BUILD into a folder that goes again, and tries it there.
set -euo pipefail
build=$1 compiler=$2
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
root=$(mktemp -d)
# The record of an installation of the user's own stays what it was.
[ ! -f "$build/install_manifest.txt" ] || cp "$build/install_manifest.txt" "$root/users"
clean_up() {
  if [ -f "$root/users" ]; then cp "$root/users" "$build/install_manifest.txt"; else rm -f "$build/install_manifest.txt"; fi
  rm -rf "$root"
}
trap clean_up EXIT
fail() { printf 'installation_test: %s\n' "$*" >&2; exit 1; }

prefix=$root/prefix
cmake --install "$build" --prefix "$prefix" >"$root/log" || fail "cmake --install failed: $(tail -n 3 "$root/log")"
cd "$root"
PATH=/usr/bin:/bin

# Alone: the build's own folder is not in PATH, and programs find modules and each other.
"$prefix/bin/lumi-simulate" --example desk --views 8 --width 64 -o capture --quiet
"$prefix/bin/lumi-render" capture -o pictures --view 0 --quiet
[ -s pictures/*.png ] || fail "lumi-render wrote no picture"
"$prefix/bin/lumi-proxy" auto capture --holdout 2 --quiet || fail "lumi-proxy does not find lumi-render"
if ldd "$prefix"/bin/lumi-* | grep 'not found'; then fail "a shared library is missing"; fi
if grep -l "$build" "$prefix"/bin/lumi-*; then fail "the build's folder is named in a program"; fi

# A program of somebody else's.
[ -n "$(find "$prefix" -name LumigraphConfig.cmake)" ] || fail "there is no LumigraphConfig.cmake"
cmake -G Ninja -S "$here/consumer" -B consumer -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_BUILD_TYPE=Debug >"$root/log" 2>&1 ||
  fail "find_package(Lumigraph): $(tail -n 20 "$root/log")"
cmake --build consumer >"$root/log" 2>&1 || fail "over the libraries: $(tail -n 20 "$root/log")"
said=$(PATH="$prefix/bin:$PATH" consumer/photos capture)
[ "$said" = "8 photos, the first 64 pixels wide" ] || fail "the program over the libraries said: $said"

# Completion, by bash itself.
next() {
  bash --norc -c '
    PATH=$1:$PATH
    . "$2"
    shift 2
    COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMPREPLY=()
    "$(complete -p "$1" | sed "s/.*-F \([^ ]*\).*/\1/")" "$1" "${COMP_WORDS[COMP_CWORD]}" "${COMP_WORDS[COMP_CWORD - 1]}"
    printf "%s\n" "${COMPREPLY[@]}"' bash "$prefix/bin" "$prefix/share/bash-completion/completions/lumi-render" "$@"
}
[ "$(next lumi-render scene --similar)" = --similarity ] || fail "completion of an option: $(next lumi-render scene --similar)"
[ "$(next lumi-render scene --resolution j)" = jacobian ] || fail "completion of a word that an option takes"
[ "$(next lumi-proxy delau)" = delaunay ] || fail "completion of a command"
[ "$(next lumi-proxy delaunay --merge)" = --merge-px ] || fail "completion of a command's option"
[ -z "$(next lumi-render capt)" ] || fail "files are the shell's to complete"
# And by zsh.
if command -v zsh >/dev/null; then
  by_zsh() { zsh -f "$here/completion.zsh" "$prefix/bin" "$prefix/share/zsh/vendor-completions" "$@" || fail "completion by zsh of $1"; }
  by_zsh 'lumi-proxy delau' 'lumi-proxy delaunay'
  by_zsh 'lumi-render scene --similar' 'lumi-render scene --similarity'
else
  printf 'installation_test: zsh is not installed, and its completion was not tried\n'
fi
for program in "$prefix"/bin/lumi-*; do
  [ -e "$prefix/share/bash-completion/completions/${program##*/}" ] || fail "${program##*/} has no completion"
  [[ " $(sed -n 's/^#compdef //p' "$prefix/share/zsh/vendor-completions/_lumigraph") " == *" ${program##*/} "* ]] || fail "${program##*/} has no completion of zsh"
done

# Gone again.
cmake -D BUILD="$build" -P "$here/../../cmake/Uninstall.cmake"
left=$(find "$prefix" -not -type d; find "$prefix" -ipath '*lumigraph*')
[ -z "$left" ] || fail "left behind: $left"
