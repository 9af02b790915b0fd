#!/usr/bin/env bash
# Builds the site of all documents and the reference of the C++ library; any warning is an error.
# The exit code is 77, for a skipped test, where doxygen or mkdocs is missing.
#
#   docs_test.sh SOURCE_DIR WORK_DIR
set -euo pipefail
source=$1 work=$2

"$source/scripts/docs.sh" "$work" || { code=$?; [[ $code -eq 2 ]] && exit 77; exit "$code"; }
for page in "$source"/docs/*.md; do
  [[ -s $work/html/$(basename "$page" .md).html ]] || { echo "no page of $page" >&2; exit 1; }
done
grep -q 'href="docs/\|href="\.\./' "$work/html/index.html" && { echo "the first page leaves the site" >&2; exit 1; }
grep -q 'integrates G_j' "$work/html/api/classgamer_1_1Sampler.html"
grep -q '&lt;Phi&gt;' "$work/html/api/structgamer_1_1GalaxyCalibration.html" \
  "$work"/html/api/classgamer_1_1Texture.html
