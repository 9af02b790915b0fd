#!/usr/bin/env bash
# docs/reference.md lists every key, and docs/gutil.md every operation, as the programs declare them.
#
#   reference_test.sh GAMER SOURCE_DIR GUTIL
set -euo pipefail
diff <(tail -n +5 "$2/docs/reference.md") <("$1" --list-parameters --markdown) || {
  echo "docs/reference.md is out of date: its tables are 'gamer --list-parameters --markdown'" >&2
  exit 1
}
# From the first heading of an operation to the end.
diff <(sed -n '/^## /,$p' "$2/docs/gutil.md") <("$3" --help --markdown | sed -n '/^## /,$p') || {
  echo "docs/gutil.md is out of date: its operations are 'gutil --help --markdown'" >&2
  exit 1
}
