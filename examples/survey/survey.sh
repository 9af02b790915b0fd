#!/usr/bin/env bash
# A survey of 150 galaxies in ten commands: a catalogue by Astropy becomes an image of the LSST's ten
# years in three bands. SExtractor measures it, and its positions and magnitudes are compared with
# table TRUTH.
#
#   examples/survey/survey.sh [folder]      build/survey_example by default
#
# GAMER_BIN is the folder of gamer and gutil, by default build/release. The script needs SExtractor,
# Astropy and a minute.
set -euo pipefail
source=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
bin=$(cd "${GAMER_BIN:-$source/../../build/release}" && pwd)
export GAMER_DATA=${GAMER_DATA:-$(cd "$source/../.." && pwd)}
folder=${1:-$source/../../build/survey_example}
python=${PYTHON:-python3}
sextractor=$(command -v source-extractor || command -v sex)
mkdir -p "$folder"
cd "$folder"
cp "$source"/survey.{par,sex,param} .

"$python" "$source/catalogue.py" catalogue.ecsv
"$bin/gamer" survey.par catalogue.ecsv --print-mapping
"$bin/gamer" survey.par catalogue.ecsv --truth --overwrite
"$bin/gutil" convolve --instrument lsst sky.fits blurred.fits --overwrite
# Ten years: 184 visits of 30 s.
"$bin/gutil" noise --instrument lsst --exposure 5520 --exposures 184 --variance \
  blurred.fits observed.fits --overwrite
"$bin/gutil" rgb --bits 8 observed.fits observed.png --overwrite
"$bin/gutil" stack --layout files observed.fits observed.fits --overwrite
for band in lsst_g lsst_r lsst_i; do
  "$sextractor" observed_$band.fits -c survey.sex -CATALOG_NAME $band.cat
  "$python" "$source/compare.py" observed.fits $band.cat $band
done
