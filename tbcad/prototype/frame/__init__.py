"""The frame: base plate, uprights, bearings, motor and camera brackets."""
