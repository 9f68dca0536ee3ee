#!/usr/bin/env bash
# Runs a command of this project on a bare Debian of another release: what a newcomer with nothing installed sees.
#
#   scripts/clean-root.sh [--as-user] [--keep] [--bind FOLDER] SUITE COMMAND...     scripts/clean-root.sh trixie ./demo.sh
#
# SUITE: bookworm (Debian 12), trixie (Debian 13). The bare root comes from this machine's own package mirror by mmdebstrap;
# the tree's files as git knows them are copied into it; nothing else of this machine is seen, no compiler cache either.
# Packages once downloaded stay in build/roots, the root itself goes with the command (--keep: it stays, and is named).
# --as-user: the command runs as a user who may use sudo, not as root. --bind: FOLDER is seen there as /bound.
# What the command leaves as captures/ or as a log of ctest comes back to build/roots/SUITE-results. Needs root or sudo.
set -euo pipefail
project=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
. "$project/scripts/common.sh"
usage() { sed -n '2,10s/^# \{0,1\}//p' "$project/scripts/${BASH_SOURCE[0]##*/}"; }
arguments=("$@")

as_user=no keep=no bound=''
while [ $# -gt 0 ]; do
  case $1 in
    -h | --help) usage; exit 0 ;;
    --as-user) as_user=yes ;;
    --keep) keep=yes ;;
    --bind)
      [ -d "${2:-}" ] || die "--bind needs a folder that is there" 2
      bound=$(realpath "$2"); shift ;;
    -*) usage >&2; exit 2 ;;
    *) break ;;
  esac
  shift
done
[ $# -ge 2 ] || { usage >&2; exit 2; }
suite=$1
shift
[[ $suite =~ ^[a-z]+$ ]] || die "$suite is no name of a Debian release" 2

if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || die "a root of another release needs root or sudo here"
  exec sudo "$project/scripts/clean-root.sh" "${arguments[@]}"
fi
cd "$project"
command -v mmdebstrap >/dev/null || die "mmdebstrap is missing: apt-get install mmdebstrap"
command -v apt-get >/dev/null || die "this is no Debian: mmdebstrap takes its package mirror from apt's sources"

# The mirror that this machine's own apt reads Debian from.
mirror=$(apt-get indextargets --format '$(REPO_URI) $(ORIGIN) $(RELEASE)' 'Created-By: Packages' 2>/dev/null |
  awk '$2 == "Debian" && $1 !~ /security/ { print $1; exit }')
[ -n "$mirror" ] || die "apt's sources name no mirror of Debian (or apt-get update was never run)"
keyring=/usr/share/keyrings/debian-archive-keyring.gpg

roots=$project/build/roots
packages=$roots/$suite-packages
results=$roots/$suite-results
mkdir -p "$packages/partial" "$results"

# A bare root: what is essential, apt, and for --as-user passwd and sudo. Kept as an archive for the next time, for a week.
bare=$roots/$suite.tar
if [ -z "$(find "$bare" -mtime -7 2>/dev/null)" ]; then
  say "a bare $suite from $mirror ..."
  mmdebstrap --quiet --format=tar --variant=apt --include=ca-certificates,passwd,sudo --keyring="$keyring" "$suite" "$bare.part" "$mirror" >"$roots/$suite.log" 2>&1 || {
    tail -n 5 "$roots/$suite.log" >&2
    rm -f "$bare.part"
    die "mmdebstrap could not make a root of $suite (is $suite on $mirror? $roots/$suite.log)"
  }
  mv "$bare.part" "$bare"
fi

root=$(mktemp -d "$roots/$suite-root.XXXXXX")
clean_up() {
  [ "$keep" = yes ] && { say "the root stays in $root"; return; }
  rm -rf --one-file-system "$root"
}
trap clean_up EXIT
tar -xf "$bare" -C "$root" --numeric-owner --exclude=./dev/*
mkdir -p "$root/home/newcomer/lumigraph"
git ls-files -z --cached --others --exclude-standard | while IFS= read -r -d '' file; do [ ! -e "$file" ] || printf '%s\0' "$file"; done |
  tar --null -T - -cf - | tar -xf - -C "$root/home/newcomer/lumigraph"
cp -L /etc/resolv.conf "$root/etc/resolv.conf" 2>/dev/null || true
echo "127.0.0.1 localhost $(uname -n)" >"$root/etc/hosts"
# What apt downloads stays for the next root.
printf 'Binary::apt::APT::Keep-Downloaded-Packages "true";\nAPT::Keep-Downloaded-Packages "true";\n' >"$root/etc/apt/apt.conf.d/90keep"
user=root
if [ "$as_user" = yes ]; then
  user=newcomer
  chroot "$root" useradd --home-dir /home/newcomer --shell /bin/bash newcomer
  echo 'newcomer ALL=(ALL) NOPASSWD: ALL' >"$root/etc/sudoers.d/newcomer"
  chroot "$root" chown -R newcomer:newcomer /home/newcomer
fi

# Mounts, processes and shared memory of its own: they end with the command.
export root packages user bound
status=0
unshare --mount --pid --fork --kill-child bash -euo pipefail -c '
  mount --make-rprivate /
  mount -t proc proc "$root/proc"
  mount --rbind /sys "$root/sys"
  mount -t tmpfs -o mode=755 dev "$root/dev"
  for device in null zero full random urandom tty; do touch "$root/dev/$device"; mount --bind "/dev/$device" "$root/dev/$device"; done
  mkdir -p "$root/dev/shm" "$root/dev/pts"
  mount -t tmpfs -o mode=1777 shm "$root/dev/shm"
  mount -t devpts -o newinstance,ptmxmode=0666 devpts "$root/dev/pts"
  ln -s pts/ptmx "$root/dev/ptmx"
  ln -s /proc/self/fd "$root/dev/fd"
  for i in 0 1 2; do ln -s "/proc/self/fd/$i" "$root/dev/$(echo stdin stdout stderr | cut -d" " -f$((i + 1)))"; done
  mkdir -p "$root/var/cache/apt/archives"
  mount --bind "$packages" "$root/var/cache/apt/archives"
  if [ -n "$bound" ]; then mkdir "$root/bound"; mount --bind "$bound" "$root/bound"; fi
  cd /
  exec chroot "$root" env -i PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin LANG=C.UTF-8 HOME=/home/newcomer USER="$user" \
    $(env | grep -iE "^(https?|no)_proxy=" || true) \
    setpriv --reuid "$user" --regid "$user" --init-groups bash -c "cd /home/newcomer/lumigraph && exec \"\$@\"" bash "$@"
' bash "$@" </dev/null || status=$?

rm -rf "${results:?}"/*
for left in captures build/release/Testing/Temporary/LastTest.log build/release.log; do
  [ ! -e "$root/home/newcomer/lumigraph/$left" ] || cp -r "$root/home/newcomer/lumigraph/$left" "$results/"
done
exit $status
