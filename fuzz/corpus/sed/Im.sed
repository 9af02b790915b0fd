# wavelength: Angstrom
# flux: flambda
#
# Rest-frame template "Im" (irregular galaxies) of Coleman, Wu & Weedman 1980
# (ApJS 43, 393), extended below 1400 and above 10000 Angstrom by Bolzonella, Miralles & Pello
# 2000 (A&A 363, 476) with models of Bruzual & Charlot. Normalised to 1 at 5500 Angstrom.
# Compacted to the nodes of a piecewise-linear least-squares fit: interpolate linearly in
# wavelength. Rest-frame optical colours differ from the full template's by at most 0.002 mag.
# Taken as zero below 900 Angstrom.
    91 0
899.999 0
   900 0.5215
   920 1.029
   950 4.459
  1000 4.069
  1100 5.41
  1170 4.552
  1215 2.87
  1260 4.734
  1400 3.501
  1500 3.119
  1700 2.876
  1900 2.588
  2100 2.221
  2300 1.914
  2500 1.665
  2700 1.467
  2900 1.324
  3100 1.229
  3300 1.184
  3500 1.176
  3640 1.054
  3690 1.44
  3730 2.131
  3785 1.232
  3850 1.455
  3930 1.35
  4030 1.481
  4150 1.426
  4300 1.349
  4450 1.348
  4600 1.331
  4800 1.205
  4860 1.565
  4905 1.212
  4950 1.482
  5005 2.168
  5055 1.241
  5180 1.067
  5320 1.08
  5500 1
  5750 0.9622
  6050 0.9279
  6350 0.8776
  6600 0.8425
  7000 0.7955
  7180 0.7769
  7400 0.7556
  7900 0.7131
  8500 0.6716
  9200 0.6332
 10000 0.5945
 11000 0.4797
 12500 0.3644
 14000 0.2959
 15500 0.2567
 17000 0.2111
 18500 0.1637
 20000 0.129
 22000 0.0952
 25000 0.04087
