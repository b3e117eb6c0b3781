"""The section [prototype.base] of the design: the printed carrier of the balls."""

from typing import Annotated, Literal, TypeAlias

from pydantic import BeforeValidator, Field

from tbcad.spec.section import Section, as_tuple

Drive: TypeAlias = Literal["nema17-belt", "nema17-direct", "stage-60"]
Hold: TypeAlias = Literal["magnet", "glue"]
Lock: TypeAlias = Literal["set-screws", "clamp"]
Size: TypeAlias = Annotated[float, Field(ge=20, le=2000)]
Bed: TypeAlias = Annotated[tuple[Size, Size, Size], BeforeValidator(as_tuple)]
Magnets: TypeAlias = Annotated[
    tuple[Annotated[float, Field(ge=1, le=50)], ...],
    Field(min_length=1, max_length=20),
    BeforeValidator(as_tuple),
]
Offsets: TypeAlias = Annotated[
    tuple[Annotated[float, Field(ge=-1, le=1)], ...],
    Field(min_length=1, max_length=9),
    BeforeValidator(as_tuple),
]


class BaseSpec(Section):
    """The carrier with its seats, its hub, and how it is printed."""

    thickness_mm: float = Field(5.0, ge=1.2, le=30)
    """Thickness of the carrier's wall."""
    ribs: int = Field(4, ge=2, le=12)
    """Ribs along meridians, one at either edge."""
    rings: int = Field(2, ge=1, le=8)
    """Ribs round the axis, one at the end toward the camera."""
    rib_mm: float = Field(5.0, ge=1.2, le=30)
    """Thickness of the ribs."""
    rib_height_mm: float = Field(8.0, ge=1, le=50)
    """How far ribs stand out of the wall; next to the hub they are higher."""
    light_clearance_mm: float = Field(0.5, ge=0, le=20)
    """Least room between all light and the carrier."""
    clearance_mm: float = Field(0.5, ge=0.1, le=5)
    """Room between a ball and its cup everywhere but at the pads."""
    pad_mm: float = Field(3.0, ge=0.5, le=20)
    """Diameter of the three pads on which a ball rests; less for balls of less than 4.5 pads."""
    pad_angle_deg: float = Field(50.0, ge=20, le=70)
    """Angle between a pad's normal and the axis of its seat."""
    cup_wall_mm: float = Field(2.5, ge=0.8, le=20)
    """Wall round a cup."""
    floor_mm: float = Field(2.0, ge=0.6, le=20)
    """Wall below a cup's pocket."""
    hold: Hold = "magnet"
    """What holds a ball on its pads: a magnet below it, or glue in a well."""
    magnets_mm: Magnets = (2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 15.0)
    """Diameters of the disc magnets on sale; each ball gets the largest that fits."""
    magnet_height_mm: float = Field(3.0, ge=0.5, le=20)
    """Height of the magnets."""
    magnet_gap_mm: float = Field(0.5, ge=0.1, le=5)
    """Gap between ball and magnet, or depth of the glue well below the ball."""
    magnet_play_mm: float = Field(0.2, ge=0, le=1)
    """How much wider than the magnet its pocket is."""
    digit_mm: float = Field(6.0, ge=3, le=30)
    """Height of the digits in relief."""
    relief_mm: float = Field(0.6, ge=0.2, le=3)
    """How far the digits stand out."""
    drive: Drive = "nema17-belt"
    """What turns the base: decides the holes in its hub."""
    shaft_mm: float = Field(8.0, ge=3, le=25)
    """Diameter of the shaft's bore."""
    lock: Lock = "set-screws"
    """What holds the shaft."""
    insert_hole_mm: float = Field(4.0, ge=2, le=10)
    """Diameter of the holes for M3 heat-set inserts."""
    insert_depth_mm: float = Field(6.2, ge=2, le=20)
    """Depth of the holes for M3 heat-set inserts."""
    bed_mm: Bed = (256.0, 256.0, 256.0)
    """Width, depth and height of what the printer can make."""
    bed_margin_mm: float = Field(3.0, ge=0, le=50)
    """What of the bed stays free all round."""
    joint_mm: float = Field(8.0, ge=4, le=30)
    """Thickness of the flanges where the base is cut to fit the bed; for inserts and dowels."""
    joint_height_mm: float = Field(12.0, ge=8, le=50)
    """How far these flanges stand out of the wall."""
    screw_pitch_mm: float = Field(45.0, ge=12, le=500)
    """Distance of the screws along a joint, about."""
    dowel_mm: float = Field(3.0, ge=1, le=10)
    """Diameter of the dowel pins in the joints (ISO 8734), two to each."""
    dowel_press_mm: float = Field(0.1, ge=-0.5, le=1)
    """How much wider than its dowel a hole is that holds it; prints come out tighter."""
    dowel_slip_mm: float = Field(0.2, ge=0, le=1)
    """How much wider than its dowel the hole on the other side is."""
    coupon_offsets_mm: Offsets = (-0.1, 0.0, 0.1)
    """How far the coupon's pads are moved away from the ball."""
    density_g_cm3: float = Field(1.27, gt=0, le=20)
    """Density of the print (PETG 1.27, PLA 1.24, PA12 1.01)."""
