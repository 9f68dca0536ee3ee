# shellcheck shell=bash
# What demo.sh, test.sh and bench.sh share: sourced, from the project's root.

say() { printf '%s\n' "$*" >&2; }
die() { say "$0: $1"; exit "${2:-4}"; }

# Installs what packages.txt lists, and the packages given, where they are missing; asks nothing where nothing is.
install_packages() {
  if ! command -v dpkg-query >/dev/null; then
    say "this is no Debian: nothing is installed; packages.txt lists what is needed, by Debian's names"
    return 0
  fi
  local wanted missing
  mapfile -t wanted < <(grep -v '^[[:space:]]*\(#\|$\)' packages.txt; [ $# -eq 0 ] || printf '%s\n' "$@")
  # One query for all: the names that it does not show as installed are missing.
  missing=$(comm -23 <(printf '%s\n' "${wanted[@]}" | sort) \
    <(dpkg-query -W -f '${Package} ${db:Status-Status}\n' "${wanted[@]}" 2>/dev/null | awk '$2 == "installed" { print $1 }' | sort))
  [ -n "$missing" ] || return 0
  local as_root=()
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || die "these packages are missing, and installing them needs root or sudo: ${missing//$'\n'/ }"
    as_root=(sudo env)
  else
    as_root=(env)
  fi
  say "installing $(wc -w <<<"$missing") Debian packages ..."
  "${as_root[@]}" DEBIAN_FRONTEND=noninteractive apt-get update -qq </dev/null >&2 || die "apt-get update failed: is there a network?"
  # shellcheck disable=SC2086
  "${as_root[@]}" DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends $missing </dev/null >&2 ||
    die "apt-get install failed (see above)"
}

# install_package FILE.deb: with what it depends on, also where the same version is installed already.
install_package() {
  local file=$1 name version as_root=()
  [ -f "$file" ] || die "there is no package $file" 2
  command -v dpkg-deb >/dev/null || die "$file is a Debian package, and this is no Debian"
  name=$(dpkg-deb -f "$file" Package) && version=$(dpkg-deb -f "$file" Version) || die "$file is no Debian package" 3
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || die "installing $file needs root or sudo"
    as_root=(sudo)
  fi
  say "installing $name $version ..."
  "${as_root[@]}" apt-get update -qq </dev/null >&2 || die "apt-get update failed: is there a network?"
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --reinstall --no-install-recommends "$file" </dev/null >&2 || die "apt-get install failed (see above)"
}

# How many compilers at once: as many as there are cores, but at least 1.5 GB of memory for each.
build_jobs() {
  local cores memory_kb by_memory
  cores=$(nproc)
  memory_kb=$(awk '/^MemAvailable:/ { print $2 }' /proc/meminfo)
  by_memory=$((memory_kb / 1500000))
  [ "$by_memory" -ge 1 ] || by_memory=1
  echo $((cores < by_memory ? cores : by_memory))
}

# What is missing, where CMake found that out; else all that it said.
cannot_configure() {
  rm -f "${1%.log}/build.ninja"
  if grep -q 'These are missing' "$1"; then
    sed -n '/These are missing/,/^$/p' "$1" | sed 's/^  //' >&2
    die "install them, or leave parts out (see above)"
  fi
  cat "$1" >&2
  die "cannot configure ($1)" 5
}

# build PRESET [TARGET...]: configures where needed, builds; quiet where there is nothing to do.
build() {
  local preset=$1 log
  shift
  log=build/$preset.log
  mkdir -p build
  [ -f "build/$preset/build.ninja" ] || cmake --preset "$preset" >"$log" 2>&1 || cannot_configure "$log"
  say "building ($preset) ..."
  if [ -t 2 ]; then
    cmake --build "build/$preset" -j "$(build_jobs)" --target "$@" >&2 || die "the build failed" 5
  else
    cmake --build "build/$preset" -j "$(build_jobs)" --target "$@" >"$log" 2>&1 || { grep -v '^\[[0-9]*/[0-9]*\] \(Building\|Linking\)' "$log" | tail -n 60 >&2; die "the build failed ($log)" 5; }
  fi
}

# jpeg_for_docs PICTURE QSCALE JPEG: a picture for docs/ that tells nothing of the machine that made it (OpenImageIO writes Exif).
jpeg_for_docs() {
  ffmpeg -v error -nostdin -y -bitexact -i "$1" -pix_fmt yuvj420p -q:v "$2" -bitexact -update 1 "$3"
}
