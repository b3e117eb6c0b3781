"""Errors of a machine that no manufacturing process has: of the bought lens, sensor and LEDs.

A simulated build draws them, and a calibration can take them as its prior. All are standard
deviations of normal errors.
"""

# Along each axis, mm. Drawings of T-1 LEDs allow 0.25 mm, and a printed pocket has 0.3 mm of play,
# both as two standard deviations: root of 0.125^2 + 0.15^2.
LED_MM = 0.2
# Of k1, k2, p1, p2, k3 of OpenCV's model. Judgement: lenses sold as free from distortion are off by
# 1 % at the corner of a picture of 90 degrees, where r^2 is 1.5.
DISTORTION = (7e-3, 2e-3, 3e-4, 3e-4, 0.0)
# Of the optical axis on the sensor, along rows and columns, pixels. Judgement: 0.07 mm as two
# standard deviations on pixels of 3.45 um. The camera is turned until the picture is where it
# belongs, so this comes with the opposite tilt.
PRINCIPAL_PX = 10.0
