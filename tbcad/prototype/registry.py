"""All parts of the prototype in the order of assembly; those of the frame in that of layout."""

from tbcad.prototype.base.caps import BALLS, CAPS
from tbcad.prototype.base.fasteners import CARRIER, COUPON
from tbcad.prototype.electronics import FIRST, WIRING
from tbcad.prototype.frame.camera_gauge import GAUGE
from tbcad.prototype.frame.camera_mount import CAMERA
from tbcad.prototype.frame.driven import DRIVE
from tbcad.prototype.frame.head import HEAD
from tbcad.prototype.frame.stock import FEET, STOCK
from tbcad.prototype.homing import HOMING, ZERO
from tbcad.prototype.light.lamps import LAMPS
from tbcad.prototype.light.shroud import SHROUD
from tbcad.prototype.light.upper import UPPER
from tbcad.prototype.stage.foot import STAGE

PARTS = (
    *(COUPON, STOCK, CARRIER, CAPS, FEET, HEAD, DRIVE, HOMING, LAMPS, STAGE, UPPER, CAMERA),
    *(WIRING, ZERO, GAUGE, BALLS, SHROUD, FIRST),
)
FRAME = HEAD, FEET, STAGE, HOMING, CAMERA, LAMPS, UPPER, WIRING, GAUGE, STOCK
"""Each is laid out beside those before it: the head first, the stock under all last."""
