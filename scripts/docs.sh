#!/usr/bin/env bash
# Makes a site of README.md and all of docs/, with the reference of the C++ library from the public
# headers. Any warning is an error.
#
#   scripts/docs.sh [DIR]    # the site is DIR/html, by default build/docs/html
#
# It needs the packages that scripts/setup.sh --docs installs. Exit codes: 2 when they are missing.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

for program in doxygen mkdocs; do
  command -v "$program" >/dev/null && continue
  echo "docs: $program is missing; scripts/setup.sh --docs installs it" >&2
  exit 2
done

folder=$(realpath -m "${1:-build/docs}")
export GAMER_DOCS_PAGES=$folder/pages
rm -rf "$folder"
mkdir -p "$GAMER_DOCS_PAGES"

# Files of the repository's root become pages beside those of docs/.
cp -r docs/*.md docs/images "$GAMER_DOCS_PAGES"
sed 's#](docs/#](#g' README.md >"$GAMER_DOCS_PAGES/index.md"
for page in CONTRIBUTING CHANGELOG; do
  sed 's#](docs/#](#g' "$page.md" >"$GAMER_DOCS_PAGES/$page.md"
done
sed -i 's#](\.\./\([A-Z]*\.md\)#](\1#g' "$GAMER_DOCS_PAGES"/*.md
printf '# C++ library\n\n[Classes, functions and files](api/index.html) of the public headers.\n' \
  >"$GAMER_DOCS_PAGES/api.md"

doxygen docs/site/Doxyfile
mkdocs --quiet build --strict --config-file docs/site/mkdocs.yml --site-dir "$folder/html"
echo "docs: $folder/html/index.html"
