"""The machine with a camera: driven, photographed, calibrated, merged."""
