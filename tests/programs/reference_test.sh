#!/usr/bin/env bash
# docs/reference.md lists every key as the program declares it.
#
#   reference_test.sh GAMER SOURCE_DIR
set -euo pipefail
diff <(tail -n +5 "$2/docs/reference.md") <("$1" --list-parameters --markdown) || {
  echo "docs/reference.md is out of date: its tables are 'gamer --list-parameters --markdown'" >&2
  exit 1
}
