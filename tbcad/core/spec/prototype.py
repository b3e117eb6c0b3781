"""The section [prototype] of the design: steel balls on a base that turns, and its sections."""

from typing import Annotated, Literal, TypeAlias, get_args

from pydantic import BeforeValidator, Field

from tbcad.core.spec.errors import short_text
from tbcad.core.spec.section import AUTO, OR_AUTO, Reason, Section, as_tuple

MOST_BALLS = 1000
LEAST_LEDS, MOST_LEDS = 4, 12

GradeName: TypeAlias = Literal[
    "G3", "G5", "G10", "G16", "G20", "G24", "G28", "G40", "G60", "G100", "G200"
]
Snap: TypeAlias = Literal["cover", "nearest"]
Picture: TypeAlias = Literal["moved", "fixed"]
CapMaking: TypeAlias = Literal["printed", "turned", "none"]
Drive: TypeAlias = Literal["nema17-belt", "nema17-direct", "stage-60"]
Hold: TypeAlias = Literal["magnet", "glue"]
Firmware: TypeAlias = Literal["grblhal", "grbl", "klipper"]
HOLDS: tuple[Hold, ...] = get_args(Hold)
PAD_ANGLES_DEG = (50.0, 40.0, 30.0)  # tried in turn: flatter pads set a seat deeper, out of light
# Tried in turn: a longer boss sets the frame farther back from what the base sweeps.
HUB_BOSSES_MM = (20.0, 35.0, 50.0, 65.0)
Lock: TypeAlias = Literal["set-screws", "clamp"]
Magnets: TypeAlias = Annotated[
    tuple[Annotated[float, Field(ge=2, le=50)], ...],
    Field(min_length=1, max_length=20),
    BeforeValidator(as_tuple),
]
Offsets: TypeAlias = Annotated[
    tuple[Annotated[float, Field(ge=-1, le=1)], ...],
    Field(min_length=1, max_length=9),
    BeforeValidator(as_tuple),
]
Led: TypeAlias = Literal["LED-3", "LED-5"]

_Coordinate: TypeAlias = Annotated[float, Field(ge=-1000, le=1000)]
_Place: TypeAlias = Annotated[
    tuple[_Coordinate, _Coordinate, _Coordinate], BeforeValidator(as_tuple)
]
Names: TypeAlias = Annotated[tuple[str, ...], Field(min_length=1), BeforeValidator(as_tuple)]


def _places(value: object) -> object:
    places = as_tuple(value)
    if isinstance(places, tuple) and (not places or LEAST_LEDS <= len(places) <= MOST_LEDS):
        return places
    raise ValueError(
        f"{short_text(value)} is not allowed: give {LEAST_LEDS} to {MOST_LEDS} places [x, y, z], "
        "or [] for a stage without"
    )


def _cap_making(value: object) -> object:
    """Words as they are; true and false of designs before there were words."""
    return {True: "printed", False: "none"}[value] if isinstance(value, bool) else value


Places: TypeAlias = Annotated[tuple[_Place, ...], BeforeValidator(_places)]


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
    rib_height_mm: float = Field(20.0, ge=1, le=50)
    """Height of the ribs above the wall; next to the hub they are higher."""
    light_clearance_mm: float = Field(0.5, ge=0, le=20)
    """Minimum distance of the carrier from all light."""
    clearance_mm: float = Field(0.5, ge=0.1, le=5)
    """Gap between a ball and its cup everywhere but at the pads."""
    pad_mm: float = Field(3.0, ge=1.3, le=20)
    """Diameter of the three pads that carry a ball; smaller for balls of less than 4.5 pads."""
    pad_offset_mm: float = Field(0.0, ge=-0.05, le=0.3)
    """By how much pads are printed off their places, away from the balls: the offset of the
    coupon's seat that fits, for printers that make pads stand out too far."""
    pad_angle_deg: Annotated[float, OR_AUTO] = Field(AUTO, ge=20, le=70)
    """Angle between a pad's normal and the axis of its seat; auto: the first of 50, 40 and 30 whose
    seats stay out of the light."""
    cup_wall_mm: float = Field(2.5, ge=1.2, le=20)
    """Wall round a cup."""
    floor_mm: float = Field(2.0, ge=1.2, le=20)
    """Wall below a cup's pocket."""
    hold: Annotated[Hold, OR_AUTO] = AUTO
    """How a ball is held on its pads: by a magnet below it, or by glue in a well; auto: magnets
    where they fit."""
    magnets_mm: Magnets = (2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 12.0, 15.0, 20.0)
    """Diameters of the disc magnets on sale; each ball gets the largest that fits."""
    magnet_height_mm: float = Field(3.0, ge=0.5, le=20)
    """Height of the magnets."""
    strong_magnet_height_mm: float = Field(5.0, ge=0.5, le=20)
    """Height of the magnets of balls that those of magnet_height_mm would not hold with twice
    the force needed."""
    magnet_gap_mm: float = Field(0.5, ge=0.1, le=5)
    """Gap between ball and magnet, or depth of the glue well below the ball."""
    magnet_play_mm: float = Field(0.2, ge=0, le=1)
    """Play of the magnet in its pocket, on the diameter."""
    cap_play_mm: float = Field(0.1, ge=0.02, le=0.5)
    """Play on the diameter of a cap's spigot in its seat, which lets the cap tilt: ream the
    seat's pocket and fit the spigot."""
    digit_mm: Annotated[float, Reason("strokes are a fifth, and FDM prints 1.2")] = Field(
        6.0, ge=6, le=30
    )
    """Height of the digits in relief; on small bosses only the last digit of a number fits."""
    relief_mm: float = Field(0.6, ge=0.2, le=3)
    """Height of the digits above the surface."""
    drive: Drive = "nema17-belt"
    """Drive of the base, which decides the holes in its hub."""
    shaft_mm: float = Field(8.0, ge=3, le=25)
    """Diameter of the shaft's bore."""
    hub_boss_mm: Annotated[float, OR_AUTO] = Field(AUTO, ge=20, le=100)
    """Length of the hub's boss behind its disc, with a drive on a shaft; auto: the first of 20, 35,
    50 and 65 with which the base clears the frame."""
    lock: Lock = "set-screws"
    """How the shaft is locked in the hub."""
    insert_hole_mm: float = Field(4.0, ge=2, le=10)
    """Diameter of the holes for M3 heat-set inserts."""
    insert_depth_mm: float = Field(6.2, ge=2, le=20)
    """Depth of the holes for M3 heat-set inserts."""
    joint_mm: float = Field(8.0, ge=4, le=30)
    """Thickness of the flanges where the base is cut to fit the bed; for inserts and dowels."""
    joint_height_mm: float = Field(12.0, ge=8, le=50)
    """Height of these flanges above the wall."""
    screw_pitch_mm: float = Field(45.0, ge=12, le=500)
    """Approximate distance of the screws along a joint."""
    dowel_mm: float = Field(3.0, ge=2, le=10)
    """Diameter of the dowel pins in the joints (ISO 8734), two to each."""
    dowel_press_mm: float = Field(0.1, ge=-0.5, le=1)
    """Play on the diameter of a dowel in the hole that holds it; printed holes come out smaller."""
    dowel_slip_mm: float = Field(0.2, ge=0, le=1)
    """Play on the diameter of a dowel in the hole on the other side."""
    coupon_offsets_mm: Offsets = (-0.1, 0.0, 0.1)
    """Distances by which the coupon's pads are moved away from the ball."""
    coupon_sizes: int = Field(3, ge=1, le=99)
    """Sizes of body that have seats on the coupon: from the largest to the smallest, evenly."""

    @property
    def pad_angles_deg(self) -> tuple[float, ...]:
        """Angles of the pads that the key permits, the preferred one first."""
        return PAD_ANGLES_DEG if self.pad_angle_deg == AUTO else (self.pad_angle_deg,)

    @property
    def hub_bosses_mm(self) -> tuple[float, ...]:
        """Lengths of the hub's boss that the key permits, the preferred one first."""
        return HUB_BOSSES_MM if self.hub_boss_mm == AUTO else (self.hub_boss_mm,)

    @property
    def holds(self) -> tuple[Hold, ...]:
        """Ways to hold a ball that the key permits, the preferred one first."""
        return HOLDS if self.hold == AUTO else (self.hold,)


class MotionSpec(Section):
    """How the base is driven from stop to stop: motion, trigger and controller."""

    axis: Literal["X", "A"] = "X"
    """Axis of the controller: X with a degree for a millimetre (GRBL 1.1 has X, Y and Z only),
    or A in degrees (grblHAL and others)."""
    controller: Firmware = "grblhal"
    """Firmware of the controller, whose program and settings alone are written: grblHAL and Klipper
    switch lamp and LEDs on outputs; GRBL 1.1 has none, so with it only the lit object is
    photographed."""
    trigger: Literal["coolant", "pause"] = "coolant"
    """What triggers a photograph: a relay on the coolant output (M8, M9), or a person (M0)."""
    home_deg: float = Field(0.0, ge=-180, le=180)
    """Base angle at which the program ends, and starts with GRBL 1.1: 0 is where the pin fits."""
    home_trim_deg: float = Field(0.0, ge=-5, le=5)
    """Base angle that homing ends at, beyond the drawn one: less the angle that the controller
    shows with the zero pin in."""
    approach_deg: float = Field(1.0, ge=0, le=30)
    """Angle below the first stop at which the base starts, so that all stops are reached from one
    side."""
    feed_deg_min: float = Field(900.0, ge=1, le=100000)
    """Speed of the base."""
    acceleration_deg_s2: float = Field(50.0, gt=0, le=10000)
    """Acceleration of the base; the motor is chosen for it."""
    settle_s: float = Field(0.5, ge=0, le=60)
    """Pause at a stop before a photograph."""
    light_s: float = Field(0.1, ge=0, le=60)
    """Pause after lamp or LED is switched, before a photograph."""
    trigger_s: float = Field(0.2, gt=0, le=60)
    """Time for which the relay is on."""
    exposure_s: float = Field(1.0, ge=0, le=600)
    """Pause after the relay, while the camera exposes and saves."""
    microsteps: int = Field(16, ge=1, le=256)
    """Microsteps of the motor's driver to a full step."""
    safety: float = Field(2.0, ge=1, le=10)
    """Holding torque of the motor over the greatest torque of gravity and acceleration: for
    friction, and for what a stepper loses between full steps and at speed."""

    @property
    def homes(self) -> bool:
        """Whether the controller finds angle zero by the switch."""
        return self.controller != "grbl"


class StageSpec(Section):
    """The stage that carries the object, with LEDs at known places for calibration."""

    top_mm: Annotated[float, OR_AUTO] = Field(AUTO, ge=-1000, le=1000)
    """Height of the disc that carries the object; it must be inside the capture sphere. auto:
    19/60 of the capture diameter below the origin, or as low as it fits."""
    disc_mm: Annotated[float, OR_AUTO] = Field(AUTO, ge=4, le=500)
    """Diameter of that disc, which is turned by 180 degrees for the other half; auto: 17/60 of
    the capture diameter, at least 12."""
    object_diameter_mm: Annotated[float, OR_AUTO] = Field(AUTO, ge=1, le=1000)
    """Diameter of the room on the disc that stage and LEDs leave free for the object, an
    upright cylinder up to the capture sphere; auto: two thirds of the capture diameter."""
    led: Led = "LED-3"
    """LEDs in the pockets."""
    leds_mm: Annotated[Places, OR_AUTO] = AUTO
    """Centres of the LEDs' domes beside the object's room, not in one plane, two or more of
    them seen from each mirror past an object and other LEDs; [] for none. auto: two pairs half
    a turn apart, in proportion to the capture sphere; none in one of less than 60 mm, which has
    no room, and none where they would hide each other."""
    led_ma: float = Field(10.0, ge=0.5, le=100)
    """Current of an LED, at most; the resistor is the next larger of the series E24."""
    led_supply_v: float = Field(24.0, ge=3, le=48)
    """Voltage that LED and resistor are in series at."""
    led_wall_mm: float = Field(1.3, ge=1.2, le=20)
    """Wall round an LED's pocket."""
    wire_mm: float = Field(2.4, ge=2, le=10)
    """Width of the wires' channels."""


class LightSpec(Section):
    """Lamps that light the object, and a shroud of card that keeps other light away."""

    lamp_z_mm: Annotated[float, OR_AUTO] = Field(AUTO, ge=-1000, le=0)
    """Height of the lamps' middles: four upright ones on the uprights and on stands as far on
    the other side of the object, or where these have no room, two level ones; 0: none; auto: as
    high as light and base permit, or 0 where they permit none."""
    strips: int = Field(2, ge=1, le=6)
    """LED strips on each lamp, side by side."""
    segments: int = Field(1, ge=1, le=6)
    """Segments that each strip has, of 50 mm; of 25 mm where level strips of 50 have no room."""
    upper: Annotated[bool, OR_AUTO] = False
    """Two LEDs on rods above the object's sides, which light surfaces that face up; they hide some
    2 % of the pixels, which a merge leaves out. auto: where they fit; true: or the design is
    refused; false: surfaces that face up stay dark."""
    shroud: Annotated[bool, OR_AUTO] = AUTO
    """A box of matt black card round the whole rig; auto: where a sheet is large enough."""
    shroud_gap_mm: float = Field(10.0, ge=2, le=500)
    """Minimum distance of the card from everything in it."""


class FrameSpec(Section):
    """Base plate, uprights, and brackets for bearings, motor, camera and stage."""

    floor_mm: Annotated[float, OR_AUTO] = Field(AUTO, ge=-3000, le=-10)
    """Height of the base plate's upper face; auto: as high as camera and base permit, -230 for
    the paper's design."""
    clearance_mm: float = Field(3.0, ge=0.5, le=50)
    """Minimum distance of all static parts from the light and from what the base sweeps."""
    flange_mm: float = Field(8.0, ge=3, le=30)
    """Thickness of the brackets' flanges."""
    web_mm: float = Field(6.0, ge=3, le=30)
    """Thickness of the brackets' webs."""
    uprights_mm: float = Field(80.0, ge=70, le=300)
    """Distance between the middles of the two uprights."""
    bearing_fit_mm: float = Field(-0.05, ge=-0.5, le=0.5)
    """Play on the diameter of the bearings in their seats; below 0: a press fit."""
    belt_travel_mm: float = Field(6.0, ge=0, le=40)
    """Length by which the motor can be moved to tighten the belt, half to either side."""
    camera: str = AUTO
    """Camera that mount, fence and lamp stands are made for: its name in the lists, with a lens by
    "NAME with LENS"; none: a cylinder of camera_diameter_mm stands in for it; auto: the best that
    does, whose sizes are known, and which has room in that cylinder."""
    cameras: str = ""
    """CSV list of further cameras, as of tbcad camera (as seen from the folder tbcad runs in)."""
    lenses: str = ""
    """CSV list of further lenses."""
    camera_axis_mm: Annotated[float, OR_AUTO] = Field(AUTO, ge=5, le=300)
    """Height of the optical axis over what the camera stands on; auto: as its list has it, or half
    of camera_diameter_mm."""
    camera_back_mm: Annotated[float, OR_AUTO] = Field(AUTO, ge=10, le=1000)
    """Distance of the camera's back, and so of the fence, behind the pinhole; auto: by lens and
    body, or camera_length_mm."""
    camera_screw_mm: Annotated[float, OR_AUTO] = Field(AUTO, ge=10, le=1000)
    """Distance of the camera's tripod thread behind the pinhole; auto: by lens and body, or 50."""
    camera_travel_mm: float = Field(20.0, ge=0, le=200)
    """Length by which the camera can be moved along its axis, half to either side."""


class PrototypeSpec(Section):
    """The prototype: balls that stand in for mirrors, and the base that carries them."""

    k: Annotated[int, OR_AUTO] = Field(AUTO, ge=1, le=MOST_BALLS)
    """Number of balls, or auto: the smallest number within the limits below that has room."""
    radius_weight_deg: float = Field(0.25, ge=0, le=100)
    """Weight of the radius against the polar angle when mirrors are grouped, degrees per mm.
    Larger: groups more alike in radius (fewer pixels lost), less in direction."""
    auto_direction_max_deg: Annotated[float, OR_AUTO] = Field(AUTO, gt=0, le=90)
    """With k auto: largest angle between any mirror's direction and its ball's; auto: 63.4 / n,
    the distance of mirrors, but no less than at n = 18, 3.5."""
    auto_direction_median_deg: Annotated[float, OR_AUTO] = Field(AUTO, gt=0, le=90)
    """With k auto: largest median of that angle; auto: 0.43 of the distance of mirrors, but no
    less than at n = 18."""
    auto_lost_percent: float = Field(25.0, ge=0, le=100)
    """With k auto: largest share of the shell's pixels that the balls lose."""
    catalogues: Names = ("metric", "inch")
    """Lists of balls on sale: metric, inch, or CSV files (as seen from the folder tbcad runs
    in) with the columns size,diameter_mm,standard,grades,mass_g,source."""
    prices: Names = ("estimates",)
    """Lists of prices: estimates, or CSV files (as seen from the folder tbcad runs in) with the
    columns part,each,per_kg,currency,date,source; the first list and line that fits a part
    counts."""
    grade: GradeName = "G20"
    """Coarsest grade of the balls by ISO 3290-1, not ABMA; each is bought in the best of G10 or
    coarser that its size is sold in, and larger sizes are not used. G20 reaches 38.1 mm and
    leaves half the light unscattered; G28 (50 mm) and G40 (60 mm) leave 16 to 25 and 7 to 14 %."""
    largest_ball_mm: Annotated[float, OR_AUTO] = Field(AUTO, gt=0, le=1000)
    """Largest ball to buy, however large the lists go. Smaller: a lighter base, and more caps.
    auto: 0.8 of the semi-minor axis, at most 60."""
    snap: Snap = "cover"
    """Which ball a group gets. cover: the largest that shows the whole capture sphere for every
    mirror of the group; nearest: the one nearest to the mean radius of the group: more pixels,
    but pictures overlap."""
    ball_margin_mm: float = Field(0.75, ge=0, le=20)
    """Coverage beyond the capture sphere that balls are chosen for, so that errors of a prototype
    printed by FDM leave the whole of it after calibration; with snap cover."""
    picture: Picture = "moved"
    """What happens to a ball's picture when pictures are merged. moved: it is moved to its
    mirror's place; fixed: it stays, and balls must then be so small that few pixels remain,
    unless k is very large."""
    caps: Annotated[CapMaking, BeforeValidator(_cap_making)] = "turned"
    """How groups that need more than the largest ball get caps of their own radius, in the same
    seat. printed: in resin, polished by hand and coated; turned: in aluminium, with a diamond;
    none: they get the largest ball."""
    cap_rim_mm: float = Field(2.0, ge=0, le=50)
    """Width of the rim round the part of a cap in use."""
    ball_wall_mm: Annotated[float, OR_AUTO] = Field(AUTO, ge=0, le=50)
    """Minimum distance between two balls, and between a ball and the post or the camera: space
    for the walls of their seats. auto: 0.04 of the semi-minor axis, from 1.2 to 3."""
    light_margin_mm: float = Field(0.5, ge=0, le=20)
    """Minimum distance of a ball from the light of another."""
    post_diameter_mm: Annotated[float, OR_AUTO] = Field(AUTO, ge=0, le=200)
    """Post straight below the object, which no ball may reach; 0: none, the object is held
    through a hollow hub; auto: a third of the capture diameter, from 8 to 20."""
    camera_diameter_mm: Annotated[float, OR_AUTO] = Field(AUTO, ge=0, le=500)
    """Body of the camera behind its pinhole, which no ball may reach; 0: none; auto: 0.56 of
    the pinhole's distance from the object in steps of 5, from 25 to 60."""
    camera_length_mm: float = Field(100.0, ge=0, le=1000)
    """Length of that body, from the pinhole back."""
    max_swing_deg: float = Field(300.0, gt=0, le=360)
    """Largest swing of the base that the drive allows."""
    stop_error_deg: float = Field(0.5, gt=0, le=20)
    """Error of direction that a mirror may have from sharing a stop of the base with others.
    Larger: fewer stops."""
    base: BaseSpec = BaseSpec()
    """The printed carrier of the balls."""
    motion: MotionSpec = MotionSpec()
    """How the base is driven from stop to stop."""
    stage: StageSpec = StageSpec()
    """Stage for the object."""
    light: LightSpec = LightSpec()
    """Lamps and shroud."""
    frame: FrameSpec = FrameSpec()
    """Frame for stage, base and camera."""
