#!/usr/bin/env bash
# Builds the documentation as a site, build/site/index.html, with mkdocs from Debian; a warning (a dead link, say) is a failure.
#
#   scripts/site.sh
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. scripts/common.sh
case ${1:-} in -h | --help) sed -n '2,4s/^# \{0,1\}//p' "scripts/${BASH_SOURCE[0]##*/}"; exit 0 ;; '') ;; *) die "$1 is no option (see --help)" 2 ;; esac
install_packages mkdocs

# The pages as they lie in the tree, README as the first of them. What they link to beside pages are files of the tree.
pages=build/site-pages
rm -rf "$pages"
mkdir -p "$pages/docs"
cp CONVENTIONS.md CHANGELOG.md packages.txt "$pages"
cp README.md "$pages/index.md"
cp -r docs/. "$pages/docs"
sed -i 's#](../README.md#](../index.md#g' "$pages"/docs/*.md
sed -i 's#](README.md#](index.md#g' "$pages"/*.md
sed -i 's#](docs/)#](docs/architecture.md)#' "$pages"/*.md
# Code blocks that follow a list's item would be its paragraphs: Markdown's own rule, which GitHub does not have.
PYTHONPATH=packaging/site PYTHONDONTWRITEBYTECODE=1 mkdocs build --quiet --strict --clean -f packaging/site/mkdocs.yml
say "build/site/index.html"
