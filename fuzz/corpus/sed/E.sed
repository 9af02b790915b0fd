# wavelength: Angstrom
# flux: flambda
#
# Rest-frame template "E" (elliptical galaxies) of Coleman, Wu & Weedman 1980
# (ApJS 43, 393), extended below 1400 and above 10000 Angstrom by Bolzonella, Miralles & Pello
# 2000 (A&A 363, 476) with models of Bruzual & Charlot. Normalised to 1 at 5500 Angstrom.
# Compacted to the nodes of a piecewise-linear least-squares fit: interpolate linearly in
# wavelength. Rest-frame optical colours differ from the full template's by at most 0.002 mag.
# Taken as zero below 900 Angstrom.
    91 0
899.999 0
   900 0.02598
   920 0.03013
   950 0.05523
  1000 0.04726
  1100 0.05094
  1170 0.04239
  1215 0.03225
  1260 0.04167
  1400 0.03063
  1500 0.02753
  1700 0.02569
  1900 0.02724
  2100 0.0359
  2300 0.0326
  2500 0.02602
  2700 0.05751
  2900 0.121
  3100 0.1794
  3300 0.259
  3500 0.2645
  3640 0.2952
  3690 0.3482
  3730 0.3298
  3785 0.2851
  3850 0.2524
  3930 0.3112
  4030 0.586
  4150 0.5604
  4300 0.6216
  4450 0.796
  4600 0.8936
  4800 0.9748
  4860 0.9468
  4905 0.9478
  4950 0.9585
  5005 0.9082
  5055 0.915
  5180 0.8472
  5320 1.01
  5500 1
  5750 0.9932
  6050 1.067
  6350 0.9829
  6600 1.032
  7000 1.015
  7180 0.9134
  7400 1.044
  7900 0.8945
  8500 0.9146
  9200 0.8984
 10000 0.887
 11000 0.7723
 12500 0.638
 14000 0.5154
 15500 0.4897
 17000 0.4527
 18500 0.3278
 20000 0.2588
 22000 0.2075
 25000 0.08526
