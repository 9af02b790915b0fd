#!/usr/bin/env bash
# Checks the style of the whole source: clang-format, the rules of scripts/lint.py, and whether the
# picture of the architecture is up to date. With --tidy also the names and the checks of .clang-tidy,
# which take minutes.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

mapfile -t files < <(git ls-files '*.h' '*.cc' '*.cpp')
clang-format --dry-run --Werror "${files[@]}"
python3 scripts/lint.py
python3 scripts/architecture.py --check

if [[ ${1:-} == --tidy ]]; then
  # The commands of a build in which each file is compiled alone.
  cmake --preset debug >/dev/null
  mapfile -t sources < <(git ls-files 'src/*.cc' 'apps/*.cpp')
  printf '%s\n' "${sources[@]}" | xargs -P "$(nproc)" -n 4 clang-tidy -p build/debug --quiet
fi
