# wavelength: Angstrom
# flux: flambda
#
# Rest-frame template "Scd" (Scd spiral galaxies) of Coleman, Wu & Weedman 1980
# (ApJS 43, 393), extended below 1400 and above 10000 Angstrom by Bolzonella, Miralles & Pello
# 2000 (A&A 363, 476) with models of Bruzual & Charlot. Normalised to 1 at 5500 Angstrom.
# Compacted to the nodes of a piecewise-linear least-squares fit: interpolate linearly in
# wavelength. Rest-frame optical colours differ from the full template's by at most 0.002 mag.
# Taken as zero below 900 Angstrom.
    91 0
899.999 0
   900 0.2163
   920 0.4241
   950 1.834
  1000 1.676
  1100 2.264
  1170 1.957
  1215 1.169
  1260 2.06
  1400 1.655
  1500 1.304
  1700 1.108
  1900 1.053
  2100 0.8814
  2300 0.7576
  2500 0.6771
  2700 0.6429
  2900 0.6545
  3100 0.6845
  3300 0.7015
  3500 0.7406
  3640 0.7
  3690 0.854
  3730 1.008
  3785 0.8614
  3850 0.9387
  3930 0.9402
  4030 1.09
  4150 1.078
  4300 1.059
  4450 1.125
  4600 1.144
  4800 1.108
  4860 1.149
  4905 1.105
  4950 1.145
  5005 1.261
  5055 1.066
  5180 1.005
  5320 0.984
  5500 1
  5750 0.9535
  6050 0.9151
  6350 0.8717
  6600 0.8383
  7000 0.7877
  7180 0.7669
  7400 0.7424
  7900 0.6916
  8500 0.6355
  9200 0.5722
 10000 0.5226
 11000 0.4437
 12500 0.3582
 14000 0.2907
 15500 0.2645
 17000 0.2333
 18500 0.1767
 20000 0.138
 22000 0.106
 25000 0.04537
