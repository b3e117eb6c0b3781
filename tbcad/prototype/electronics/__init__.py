"""The electronics: outputs of the controller, lamp and LEDs on them, resistors, wires."""
