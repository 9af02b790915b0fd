# wavelength: Angstrom
# flux: flambda
#
# Rest-frame template "Sbc" (Sbc spiral galaxies) of Coleman, Wu & Weedman 1980
# (ApJS 43, 393), extended below 1400 and above 10000 Angstrom by Bolzonella, Miralles & Pello
# 2000 (A&A 363, 476) with models of Bruzual & Charlot. Normalised to 1 at 5500 Angstrom.
# Compacted to the nodes of a piecewise-linear least-squares fit: interpolate linearly in
# wavelength. Rest-frame optical colours differ from the full template's by at most 0.002 mag.
# Taken as zero below 900 Angstrom.
    91 0
899.999 0
   900 0.08015
   920 0.1558
   950 0.6692
  1000 0.6119
  1100 0.8262
  1170 0.7147
  1215 0.4265
  1260 0.7526
  1400 0.6056
  1500 0.4786
  1700 0.403
  1900 0.404
  2100 0.3771
  2300 0.36
  2500 0.3586
  2700 0.3594
  2900 0.3644
  3100 0.3929
  3300 0.4602
  3500 0.5903
  3640 0.5934
  3690 0.6806
  3730 0.732
  3785 0.7028
  3850 0.7856
  3930 0.7829
  4030 0.9487
  4150 0.9536
  4300 0.9313
  4450 1.03
  4600 1.049
  4800 1.036
  4860 1.013
  4905 1.001
  4950 1.006
  5005 1.022
  5055 0.9833
  5180 0.9574
  5320 0.9528
  5500 1
  5750 0.9478
  6050 0.9078
  6350 0.8953
  6600 0.8815
  7000 0.8628
  7180 0.856
  7400 0.8483
  7900 0.8295
  8500 0.8119
  9200 0.7931
 10000 0.7876
 11000 0.6706
 12500 0.5465
 14000 0.4443
 15500 0.4094
 17000 0.3655
 18500 0.274
 20000 0.2144
 22000 0.1663
 25000 0.07067
