#!/usr/bin/env bash
# Installs a build, compares the data, then configures, builds and runs the examples against it.
#
#   package_test.sh CMAKE BUILD_DIR SOURCE_DIR WORK_DIR COMPILER COMPILER_FLAGS
set -euo pipefail
cmake=$1 build=$2 source=$3 work=$4 compiler=$5 flags=$6

rm -rf "$work"
"$cmake" --install "$build" --prefix "$work/prefix" >/dev/null
if grep -rF --include='*.cmake' -e "$source/" -e "$build/" "$work/prefix"; then
  echo "the installed package points at the source or the build tree" >&2
  exit 1
fi

for folder in seds bandpasses galaxies instruments scenes; do
  diff -r "$source/$folder" "$work/prefix/share/gamer/$folder"
done

# Manual pages without warnings, and what shells offer.
share=$work/prefix/share
offers() { # offers PROGRAM WORD...: what bash offers for the last word
  bash -c 'source "$1" && shift && COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
    "_${1##*/}" "$1" "${@: -1}" "${@: -2:1}" && printf "%s\n" "${COMPREPLY[@]}"' \
    bash "$share/bash-completion/completions/$1" "$work/prefix/bin/$1" "${@:2}"
}
expect() { # expect TEXT PROGRAM WORD...: bash offers exactly these words
  local offered
  offered=$(offers "${@:2}" | sort | xargs)
  [[ $offered == "$1" ]] || { echo "${*:2}: bash offers '$offered', not '$1'" >&2; exit 1; }
}
programs="gamer gutil"
if [[ -e $work/prefix/bin/gstudio ]]; then programs+=" gstudio"; fi
for program in $programs; do
  page=$share/man/man1/$program.1
  warnings=$(groff -man -ww -z "$page" 2>&1; MANWIDTH=80 man -l --warnings "$page" 2>&1 >/dev/null)
  [[ -z $warnings ]] || { echo "$page: $warnings" >&2; exit 1; }
  grep -q "^#compdef $program" "$share/zsh/site-functions/_$program"
  if command -v zsh >/dev/null; then zsh -n "$share/zsh/site-functions/_$program"; fi
done
# Every option and every operation has its entry.
for program in $programs; do
  MANWIDTH=200 man -l "$share/man/man1/$program.1" | sed 's/.\x08//g' >"$work/$program.txt"
done
for option in $("$work/prefix/bin/gamer" --help | grep -oE '^  (-[a-z],)?--[a-z-]+' | sed 's/.*-\(-.*\)/-\1/'); do
  grep -qE -- "^ +(-[a-z], )?$option( |\$)" "$work/gamer.txt" || lacking="$option of gamer"
done
for operation in $("$work/prefix/bin/gutil" --help | sed -n 's/^  \([a-z]*\) .*/\1/p' | grep -v gutil); do
  grep -qx "   $operation" "$work/gutil.txt" || lacking="gutil $operation"
done
[[ -z ${lacking:-} ]] || { echo "the manual pages lack $lacking" >&2; exit 1; }
export GAMER_DATA=$share/gamer
expect "--list-bands --list-components --list-galaxies --list-instruments --list-noises --list-parameters --list-seds" \
  gamer --li
expect "--list-galaxies" gamer --list-g
expect "m101 m33 m51 m74 m83 milky_way" gamer look m
expect "m51" gamer new -q m5
expect "--inclination" gamer look m51 --inc
expect "json" gamer --log j
expect "json" gamer --log = j
expect "spectrum.band_samples= spectrum.bands=" gamer --set spectrum.b
expect "camera" gamer --list-parameters cam
expect "--psf" gutil convolve --ps
expect "--position-angle --precision --psf" gutil convolve --p
expect "convolve" gutil conv
expect "normalise normalize" gutil norm
expect "--peak --per --percentile-range" gutil normalize --pe
unset GAMER_DATA

for example in render_to_memory scene_in_memory parameter_sweep new_component; do
  "$cmake" -G Ninja -S "$source/examples/$example" -B "$work/$example" \
    -DCMAKE_BUILD_TYPE=Release -DCMAKE_CXX_COMPILER="$compiler" -DCMAKE_CXX_FLAGS="$flags" \
    -DCMAKE_PREFIX_PATH="$work/prefix"
  "$cmake" --build "$work/$example"
done

cd "$work"
data=$work/prefix/share/gamer
GAMER_DATA=$data render_to_memory/render_to_memory "$data/scenes/ngc4594.par" "$data/scenes/ngc4594.lst" |
  tee totals.txt
[[ $(grep -cE '^(4300|5750|7400)A: total [0-9.]*[1-9]' totals.txt) -eq 3 ]]
# Bands are no wavelengths.
GAMER_DATA=$data render_to_memory/render_to_memory "$data/scenes/survey.par" "$data/scenes/survey.lst" |
  tee totals.txt
[[ $(grep -cE '^hst_f(435|606|814)w: total [0-9.e+]*[1-9]' totals.txt) -eq 3 ]]

GAMER_DATA=$data new_component/new_component | tee egg.txt
grep -qE '^flux / asked = (1|1\.000[0-4]|0\.999[6-9])' egg.txt

# Galaxies in memory; the dust dims each.
GAMER_DATA=$data scene_in_memory/scene_in_memory memory.fits 2>/dev/null | tee objects.txt
grep -qx '64 x 48 pixels in nJy' objects.txt
[[ $(awk '/^galaxy/ && $5 > $NF { ++dimmed } END { print dimmed }' objects.txt) -eq 3 ]]
"$work/prefix/bin/gamer" --from-header memory.fits -o again.fits -q --overwrite

# Inclinations and depths of dust; dust reddens, and later renders measure less than the first.
GAMER_DATA=$data parameter_sweep/parameter_sweep elliptical_dust band | tee sweep.txt
[[ $(grep -c '^inclination' sweep.txt) -eq 9 ]]
grep -qE '^(cancelled|done before it was cancelled)$' sweep.txt

# Without CMake. MPI's own libraries may be built with another compiler's options.
export PKG_CONFIG_PATH=$(dirname "$(find "$work/prefix" -name gamer.pc)")
read -ra linked <<<"$(pkg-config --cflags --libs gamer)"
read -ra with_flags <<<"$flags"
"$compiler" "${with_flags[@]}" -O1 "$source/examples/scene_in_memory/main.cpp" -o by_pkg_config "${linked[@]}"
GAMER_DATA=$data ./by_pkg_config 2>/dev/null | diff - objects.txt

# The Python package beside the programs.
package=$(find "$work/prefix" -name '_core*.so' -printf '%h\n' | head -1)
if [[ -n $package ]]; then
  cd /
  PYTHONPATH=${package%/gamer} PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 -c '
import gamer
assert "ngc4321" in gamer.galaxies(), gamer.galaxies()
gamer.Galaxy.load("ngc4321")'
  PYTHONPATH=${package%/gamer} PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 -m gamer --version |
    diff - <("$work/prefix/bin/gamer" --version)
fi
