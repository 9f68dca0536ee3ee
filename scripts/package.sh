#!/usr/bin/env bash
# Builds Debian packages of the programs, the libraries and the Python module: build/packages/*.deb.
#
#   scripts/package.sh             builds them; then: sudo apt install ./build/packages/lumigraph_*.deb
#   scripts/package.sh --check     and has them looked at by lintian and groff, installed on a bare Debian of this release
#                                  (scripts/clean-root.sh), the main job run there, and removed again
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. scripts/common.sh

check=''
case ${1:-} in
  '') ;;
  --check) check=yes ;;
  -h | --help) sed -n '2,6s/^# \{0,1\}//p' "scripts/${BASH_SOURCE[0]##*/}"; exit 0 ;;
  *) die "$1 is no option (see --help)" 2 ;;
esac

install_packages dpkg-dev help2man file
# Configured anew where help2man was not there before.
[ -f build/release/build.ninja ] && ! grep -q '^LUMI_HELP2MAN:FILEPATH=/' build/release/CMakeCache.txt && cmake build/release >/dev/null
build release lumi-calibrate lumi-export lumi-pipeline lumi-proxy lumi-reconstruct lumi-render lumi-simulate lumi-stabilize \
  lumi-timeperiodic lumi-view lumi_python_package
cmake --build build/release --target man >build/man.log 2>&1 || { cat build/man.log >&2; die "the manual pages cannot be made" 5; }
rm -rf build/packages
(cd build/release && cpack -B "$OLDPWD/build/packages" >"$OLDPWD/build/package.log" 2>&1) || { tail -n 20 build/package.log >&2; die "cpack failed (build/package.log)" 5; }
rm -rf build/packages/_CPack_Packages
ls -l build/packages/*.deb >&2
[ -n "$check" ] || exit 0

install_packages lintian man-db groff mmdebstrap
for page in build/release/man/*.1; do
  said=$(LC_ALL=C.UTF-8 MANROFFSEQ='' MANWIDTH=80 man --warnings -E UTF-8 -l -Tutf8 -Z "$page" 2>&1 >/dev/null)
  [ -z "$said" ] || die "groff on $page: $said" 1
done
say "manual pages: no warning of groff"
lintian --fail-on error build/packages/*.deb >build/lintian.log 2>&1 || { grep '^E:' build/lintian.log >&2; die "lintian found errors (build/lintian.log)" 1; }
say "lintian: no error"
suite=$(. /etc/os-release && echo "$VERSION_CODENAME")
scripts/clean-root.sh --bind build/packages "$suite" bash -euo pipefail -c '
  apt-get update -qq
  find /usr /etc /opt -xdev | sort >/tmp/before
  DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends /bound/lumigraph_*.deb /bound/python3-lumigraph_*.deb >/dev/null
  cd /tmp
  lumi-simulate --example desk --views 24 --width 320 -o capture --quiet
  lumi-pipeline capture/images -o scene --quiet
  test -s scene/report.html
  /usr/bin/python3 -c "import lumigraph as lg; l = lg.open(\"scene\"); print(l.render(l.scene.view(\"0\")).rgb.shape)"
  man -w lumi-render >/dev/null 2>&1 || test -s /usr/share/man/man1/lumi-render.1.gz
  dpkg --remove lumigraph python3-lumigraph >/dev/null
  find /usr /etc /opt -xdev | grep -E "lumi-|lumigraph|liblumi" >/tmp/left || true
  if test -s /tmp/left; then echo "left behind:"; cat /tmp/left; exit 1; fi
  ! command -v lumi-render
'
say "installed on a bare $suite, the main job run, removed: nothing left behind"
